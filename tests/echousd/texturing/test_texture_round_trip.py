"""Rooms out to a painter and back: every point of a surface gets its colour, through each tool's own files."""

import json
import shutil

import numpy as np
import pytest
import trimesh
import yaml
from painter import color_at, errors_in_texels, filled, in_room, paint, painted
from PIL import Image
from pxr import UsdShade, UsdValidation
from small_room import small_room

import echousd
from echousd.checks import check
from echousd.exporting.formats import export
from echousd.layers.paintings import primvar
from echousd.options import RoomOptions
from echousd.stage.files import open_stage
from echousd.texturing import export as texturing_export
from echousd.texturing import export_texture_job as export_job
from echousd.texturing import import_texture_job as import_job
from echousd.texturing import scenetex
from echousd.texturing.atlas import Unwrapped, texel_faces
from echousd.texturing.job import job_mesh
from echousd.texturing.obj import glb_bytes
from echousd.texturing.results import read_results

SIDE, SQUARE = 768, 352  # pixels of a picture for all, and of one for each object or all small things


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A room of three pieces of parts with walls, a window and small things."""
    graph = echousd.read_graph("samples/study.usda")
    for name in ("books", "armchair", "floor_lamp", "ceiling_lamp"):
        graph = graph.remove_node(name)
    data = echousd.generate(graph, seed=6, drafts=1, options=RoomOptions(walls=True, dress="some"))
    return data.save(tmp_path_factory.mktemp("rooms") / "study", preview=False)


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    data = small_room(shapes="boxes", place=False)
    return data.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


@pytest.fixture(scope="module")
def generic(room, tmp_path_factory):
    """The room's job for any tool, its small things as one object, and the folder it is in."""
    folder = tmp_path_factory.mktemp("generic") / "job"
    return export_job(room, folder, "generic", dressing="grouped", resolution=SQUARE), folder


def copied(root, tmp_path):
    return shutil.copytree(root.parent, tmp_path / root.parent.name) / root.name


@pytest.fixture
def small_pictures(monkeypatch):
    monkeypatch.setattr(scenetex, "RESOLUTION", SIDE)


@pytest.mark.parametrize("tool", ["scenetex", "generic"])
def test_every_point_gets_its_colour_back(room, generic, tool, tmp_path, small_pictures):
    root = copied(room, tmp_path)
    if tool == "generic":
        job, made = generic
        shutil.copytree(made, tmp_path / "job")
    else:
        job = export_job(root, tmp_path / "job", tool)
    assert not job.left_out
    assert {thing.kind for thing in job.objects} == {"stuff", "things"}
    paint(tmp_path / "job")
    look = import_job(root, tmp_path / "job", name="rainbow", preview=False)
    assert set(look.painted) == {thing.name for thing in job.objects}
    wrong = errors_in_texels(root, job)
    assert len(wrong) > 400 * len(job.objects) / 2
    assert np.quantile(wrong, 0.99) < 0.75  # half a texel's diagonal: pictures are looked up at the nearest texel
    assert wrong.max() < 2.5  # where a chart ends
    report = check(root)
    assert not report.errors
    assert not report.warnings


def test_a_picture_of_no_object_is_named(generic, tmp_path):
    job, made = generic
    folder = shutil.copytree(made, tmp_path / "job")
    for name in ("desk", "dekc", "desk_normal"):
        Image.new("RGB", (4, 4)).save(folder / "results" / f"{name}.png")
    with pytest.warns(UserWarning, match=r"dekc\.png: no object of the job is called 'dekc'; it is left out") as told:
        assert read_results(folder, job)[0].keys() == {"desk"}
    assert len(told) == 1


def test_charts_are_unique_and_inside(generic):
    job, folder = generic
    for thing in job.objects:
        corners = job_mesh(folder, thing).corners
        assert corners.min() >= 0
        assert corners.max() <= 1
        _, bary, place = texel_faces(corners, SQUARE)
        inner = place[(bary > 1e-6).all(1)]
        assert len(np.unique(inner, axis=0)) == len(inner), thing.name


def test_scenetex_files_are_as_it_reads_them(small, tmp_path, small_pictures):
    job = export_job(small, tmp_path / "job", "scenetex")
    scene = tmp_path / "job/data/scenes/bedroom/room"
    config = json.loads((scene / "meshes/scene_config.json").read_text())
    assert list(config) == [str(number) for number in range(len(job.objects))]
    assert {entry["type"] for entry in config.values()} == {"stuff", "things"}
    sphere = yaml.safe_load((scene / "cameras/sphere.yaml").read_text())
    assert all(set(sphere[word]) == {"min", "max", "num_linspace"} for word in ("dist", "elev", "azim", "fov"))
    assert np.shape(sphere["at"]) == (1, 3)
    run = tmp_path / "job" / scenetex.run_folder(job.prompt) / "meshes"
    seeded = json.loads((run / "scene_config.json").read_text())
    whole = (run / "scene.obj").read_text().splitlines()
    assert sum(entry["num_vertices"] for entry in seeded.values()) == sum(line.startswith("v ") for line in whole)
    for number, entry in config.items():
        assert entry["path"].startswith(f"data/scenes/bedroom/room/meshes/{entry['type']}/")
        lines = (tmp_path / "job" / entry["path"]).read_text().splitlines()
        assert sum(line.startswith("usemtl") for line in lines) == 1
        assert all(len(line.split()) == 4 for line in lines if line.startswith("f "))
        assert (run / entry["type"] / f"{number}_{entry['name']}.obj").is_file()
    assert "stable-diffusion-v1-5/stable-diffusion-v1-5" in (tmp_path / "job/run.sh").read_text()
    # as trimesh reads it there, triangles come in our order and in the room's own metres
    thing = job.objects[-1]
    there = trimesh.load(tmp_path / "job" / thing.mesh, force="mesh")
    assert np.allclose(there.triangles, in_room(job_mesh(tmp_path / "job", thing), thing), atol=1e-5)


def test_scenetex_may_lay_out_anew(small, tmp_path, small_pictures):
    root = copied(small, tmp_path)
    job = export_job(root, tmp_path / "job", "scenetex")
    run = tmp_path / "job" / scenetex.run_folder(job.prompt)
    whole = None
    for number, thing in enumerate(job.objects):  # its own meshes, all turned by a quarter in the picture
        mesh = job_mesh(tmp_path / "job", thing)
        turned = Unwrapped(mesh.points, np.stack([1 - mesh.st[:, 1], mesh.st[:, 0]], 1), mesh.faces)
        (run / "meshes" / thing.kind / f"{number}_{thing.name}.obj").write_bytes(
            scenetex.obj_bytes(turned, thing.name, material=False)
        )
        whole = painted((turned.corners * (SIDE - 1) + 0.5) / SIDE, in_room(mesh, thing), SIDE, whole)
    filled(np.full((SIDE, SIDE, 3), 0.1)).save(run / "texture_100.png")
    filled(whole).save(run / "texture_29900.png")
    import_job(root, tmp_path / "job", preview=False)
    assert np.quantile(errors_in_texels(root, job), 0.99) < 0.75


def exported_again(mesh, thing, resolution, rng):
    """A glb as exporters write it: vertices split and shuffled, triangles re-ordered, another atlas, turned, scaled."""
    order = rng.permutation(len(mesh.faces))
    begin = rng.integers(0, 3, len(order))
    corners = (begin[:, None] + np.arange(3)) % 3
    rows = np.arange(len(order))[:, None]
    triangles, st = mesh.triangles[order][rows, corners], mesh.corners[order][rows, corners]
    st = 0.02 + 0.96 * np.stack([st[..., 1], 1 - st[..., 0]], -1)  # turned and shrunk in the picture
    shuffle = rng.permutation(3 * len(order))
    points, laid = np.empty((3 * len(order), 3)), np.empty((3 * len(order), 2))
    points[shuffle], laid[shuffle] = triangles.reshape(-1, 3), st.reshape(-1, 2)
    to_room = np.array(thing.to_room)
    picture = painted(st, triangles @ to_room[:3, :3].T + to_room[:3, 3], resolution)
    points = points @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]).T * 0.37 + (0.1, 0.2, 0.3)  # z up
    return glb_bytes(Unwrapped(points, laid, shuffle.reshape(-1, 3)), thing.name, filled(picture))


@pytest.mark.parametrize("tool", ["hunyuan", "mvpainter"])
def test_glb_comes_back_in_any_order(small, tool, tmp_path, monkeypatch):
    monkeypatch.setattr(texturing_export, "IMAGE", 48)
    root = copied(small, tmp_path)
    job = export_job(root, tmp_path / "job", tool, resolution=512)
    assert {path.stem for path in (tmp_path / "job/glbs").iterdir()} == {thing.name for thing in job.objects}
    assert {path.stem for path in (tmp_path / "job/imgs").iterdir()} == {thing.name for thing in job.objects}
    assert {thing.kind for thing in job.objects} == {"things"}
    assert job.left_out["Floor"] == "floor, wall or ceiling (--shell takes it along)"
    rng = np.random.default_rng(1)
    folder = tmp_path / "job/results" if tool == "hunyuan" else tmp_path / "job/results/glbs"
    folder.mkdir(exist_ok=True)
    for thing in job.objects:
        content = exported_again(job_mesh(tmp_path / "job", thing), thing, 512, rng)
        (folder / f"{thing.name}.glb").write_bytes(content)
    look = import_job(root, tmp_path / "job", preview=False)
    assert len(look.painted) == len(job.objects)
    wrong = errors_in_texels(root, job)
    assert np.quantile(wrong, 0.99) < 0.75
    assert wrong.max() < 2.5


def test_the_shell_is_painted_where_it_is_asked_for(small, tmp_path, monkeypatch):
    monkeypatch.setattr(texturing_export, "IMAGE", 16)
    root = copied(small, tmp_path)
    with_it = export_job(root, tmp_path / "with", "hunyuan", resolution=64, shell=True)
    without = export_job(root, tmp_path / "without", "generic", resolution=64, shell=False)
    assert "Floor" in {thing.name for thing in with_it.objects} - {thing.name for thing in without.objects}


def bound(stage, path):
    return str(UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(path)).ComputeBoundMaterial()[0].GetPath())


def test_variants_switch_and_exports_carry_the_look(small, tmp_path):
    root = copied(small, tmp_path)
    before = bound(open_stage(root), "/Room/Objects/wardrobe/geo/wardrobe_mesh")
    job = export_job(root, tmp_path / "job", "generic", resolution=256)
    paint(tmp_path / "job")
    import_job(root, tmp_path / "job", name="first", preview=False)
    import_job(root, tmp_path / "job", name="second", preview=False)
    stage = open_stage(root)
    variants = stage.GetPrimAtPath("/Room").GetVariantSet("looks")
    assert sorted(variants.GetVariantNames()) == ["first", "made", "second"]
    for name, material in (("second", "/Room/Looks/second_wardrobe"), ("first", "/Room/Looks/first_wardrobe")):
        variants.SetVariantSelection(name)
        assert bound(stage, "/Room/Objects/wardrobe/geo/wardrobe_mesh") == material
        assert stage.GetPrimAtPath("/Room/Objects/wardrobe/geo/wardrobe_mesh").HasAttribute(f"primvars:{primvar(name)}")
    variants.SetVariantSelection("made")
    assert bound(stage, "/Room/Objects/wardrobe/geo/wardrobe_mesh") == before
    stage.Reload()
    assert variants.GetVariantSelection() == "second"
    every = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert [error.GetMessage() for error in UsdValidation.ValidationContext(every).Validate(stage)] == []
    scene = trimesh.load(export(root, tmp_path / "room.glb"))
    images = [part.visual.material.baseColorTexture for part in scene.geometry.values()]
    assert sum(image is not None and image.size == (256, 256) for image in images) == len(job.objects)
    flat = open_stage(export(root, tmp_path / "room.usdz"))
    mesh = flat.GetPrimAtPath("/Room/Objects/wardrobe/geo/wardrobe_mesh")
    binding = UsdShade.MaterialBindingAPI(mesh)
    assert str(binding.GetDirectBinding().GetMaterialPath()) == "/Room/Looks/second_wardrobe"
    assert not any(UsdShade.MaterialBindingAPI(p).GetCollectionBindingRels() for p in flat.TraverseAll())
    assert not check(tmp_path / "room.usdz").errors


def test_shared_instances_get_a_picture_each(small, tmp_path):
    root = copied(small, tmp_path)
    twins = [f"/Room/Objects/nightstand_{side}" for side in ("left", "right")]
    for path, layer in zip(twins, (root, root.parent / "layers/geometry.usda"), strict=True):
        stage = open_stage(layer)
        stage.GetPrimAtPath(path).SetInstanceable(True)
        stage.GetRootLayer().Save()
    job = export_job(root, tmp_path / "job", "generic", resolution=512)
    paint(tmp_path / "job")
    import_job(root, tmp_path / "job", preview=False)
    stage = open_stage(root)
    assert not any(stage.GetPrimAtPath(path).IsInstanceable() for path in twins)
    assert len({bound(stage, f"{path}/geo/nightstand_mesh") for path in twins}) == 2
    assert np.quantile(errors_in_texels(root, job), 0.99) < 0.75


def test_colours_are_a_function_of_the_place():
    points = np.random.default_rng(0).random((50, 3))
    assert color_at(points).shape == (50, 3)
    assert len(np.unique(color_at(points).round(3), axis=0)) == 50


def test_rooms_with_z_up_are_painted_alike(small, tmp_path):
    data = small_room(shapes="boxes", place=False, up_axis="Z", walls=True)
    root = data.save(tmp_path / "bedroom", preview=False)
    job = export_job(root, tmp_path / "job", "generic", resolution=256)
    frames = {thing.name: thing.to_room for thing in job.objects}
    for thing in export_job(small, tmp_path / "y_up", "generic").objects:  # a painter is shown each from its front
        np.testing.assert_allclose(frames[thing.name], thing.to_room, atol=1e-5)
    paint(tmp_path / "job")
    import_job(root, tmp_path / "job", preview=False)
    assert np.quantile(errors_in_texels(root, job), 0.99) < 0.75
    assert not check(root).errors
