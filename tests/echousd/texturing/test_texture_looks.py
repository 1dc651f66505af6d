"""A painted look stays the user's: regeneration and edits keep its layer and say what of it fits no longer."""

import json
import os
import shutil
import warnings

import numpy as np
import pytest
import trimesh
from painter import errors_in_texels, paint
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.checks import check
from echousd.folder.history import redo, undo
from echousd.make.edit import edit
from echousd.make.reading import read_room
from echousd.stage.files import open_stage
from echousd.stage.read import read_graph
from echousd.texturing import atlas
from echousd.texturing import export_texture_job as export_job
from echousd.texturing import import_texture_job as import_job
from echousd.texturing.atlas import Unwrapped
from echousd.texturing.job import job_mesh
from echousd.texturing.obj import glb_bytes
from echousd.texturing.results import texture_coordinates

SIZE = 128


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A room and its painted job."""
    top = tmp_path_factory.mktemp("rooms")
    data = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    root = data.save(top / "bedroom", preview=False)
    export_job(root, top / "job", "generic", resolution=SIZE)
    paint(top / "job")
    return top


@pytest.fixture
def room(made, tmp_path):
    """Root layer of a copy of it, the job beside."""
    shutil.copytree(made, tmp_path / "here")
    return tmp_path / "here/bedroom/bedroom.usda"


def job_of(room):
    return room.parent.parent / "job"


def material(root, name):
    """Name of the material that the first visible mesh of an object shows, "" where its subsets have their own."""
    stage = open_stage(root)
    meshes = [p for p in Usd.PrimRange(stage.GetPrimAtPath(f"/Room/Objects/{name}")) if p.IsA(UsdGeom.Mesh)]
    seen = next(p for p in meshes if UsdGeom.Imageable(p).ComputePurpose() == "default")
    found = UsdShade.MaterialBindingAPI(seen).ComputeBoundMaterial()[0]
    return found.GetPrim().GetName() if found else ""


def generated(root, graph):
    data = echousd.generate(graph, model=StandIn(), shapes="boxes", place=False, **BARE)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        data.save(root.parent, preview=False)
    return [str(entry.message) for entry in told if "painted" in str(entry.message)]


def test_a_persons_files_where_a_look_would_lie_are_left(room):
    """Not only the look's own layer; and the root layer's remarks, which USD does not write again, stay beside it."""
    probe = room.parent.parent / "probe"
    shutil.copytree(room.parent, probe)
    import_job(probe / room.name, job_of(room), name="oil", preview=False)
    theirs = [path.relative_to(probe) for path in (probe / "looks/oil").rglob("*") if path.is_file()]
    assert len(theirs) > 1
    for path in theirs:
        own = room.parent / path
        own.parent.mkdir(parents=True, exist_ok=True)
        own.write_bytes(b"mine")
        with pytest.raises(ValueError, match=f"{path.name}: exists; choose another --name or use --force"):
            import_job(room, job_of(room), name="oil", preview=False)
        assert own.read_bytes() == b"mine"
        own.unlink()
    mine = room.read_text().rstrip()[:-1] + "    # a remark\n}\n"
    room.write_text(mine)
    with pytest.warns(UserWarning, match="bedroom.usda: not as echousd wrote it; kept as bedroom.edited.usda"):
        import_job(room, job_of(room), name="oil", preview=False)
    assert (room.parent / "bedroom.edited.usda").read_text() == mine


def test_an_edit_of_a_room_whose_root_was_edited_is_taken_back_after_an_import(room):
    room.write_text(room.read_text().rstrip()[:-1] + '    def Cube "Toy"\n    {\n    }\n}\n')
    fewer = small_graph().remove_node("pendant")
    edit(room, fewer, model=StandIn(), shapes="boxes", place=False).save(room.parent, preview=False)
    import_job(room, job_of(room), name="oil", skip=("pendant",), preview=False)
    after = room.read_bytes()
    undo(room)
    assert "pendant" in read_graph(room).names
    redo(room)
    assert room.read_bytes() == after


def test_generating_again_keeps_the_look_and_the_file(room):
    import_job(room, job_of(room), name="oil", preview=False)
    files = {path: path.read_bytes() for path in (room.parent / "looks").rglob("*") if path.is_file()}
    before = room.read_bytes()
    assert generated(room, small_graph()) == []
    assert room.read_bytes() == before
    assert {path: path.read_bytes() for path in files} == files
    assert material(room, "wardrobe") == "oil_wardrobe"
    root = json.loads((room.parent / "bedroom.json").read_text())["files"]
    assert not any(path.startswith("looks/") for path in root)  # the user's own


def test_a_file_that_is_called_looks_is_named(room):
    (room.parent / "looks").write_text("mine")
    before = room.read_bytes()
    with pytest.raises(ValueError, match=r"bedroom/looks: is a file, where a folder of the room belongs; nothing was"):
        import_job(room, job_of(room), name="oil", preview=False)
    assert (room.parent / "looks").read_text() == "mine"
    assert room.read_bytes() == before
    assert not (room.parent / ".echousd").exists() or not list((room.parent / ".echousd").glob("journal*"))
    (room.parent / "looks").unlink()
    import_job(room, job_of(room), name="oil", preview=False)


def test_what_changed_is_shown_as_made_and_told(room):
    import_job(room, job_of(room), name="oil", preview=False)
    layer = (room.parent / "looks/oil.usda").read_bytes()
    graph = small_graph().remove_node("pendant")
    told = generated(room, graph)
    assert len(told) == 1
    assert "looks/oil.usda: pendant changed or gone since painted; shown as made, export and paint again" in told[0]
    assert (room.parent / "looks/oil.usda").read_bytes() == layer
    assert material(room, "wardrobe") == "oil_wardrobe"
    assert not check(room).errors
    assert generated(room, small_graph()) == []  # it is back as it was
    assert material(room, "pendant") == "oil_pendant"
    assert not (room.parent / "layers/unfit.usda").exists()


def test_edits_mute_what_they_change(room):
    import_job(room, job_of(room), name="oil", preview=False)
    saved = read_room(room)
    graph = saved.graph.update_node("pendant", category="wardrobe")
    with pytest.warns(UserWarning, match="pendant changed or gone since painted"):
        edit(room, graph, model=StandIn(), shapes="boxes", place=False).save(room.parent, preview=False)
    assert material(room, "pendant") != "oil_pendant"
    assert material(room, "wardrobe") == "oil_wardrobe"
    assert not check(room).errors
    with pytest.raises(ValueError, match="pendant has other meshes; export again, or leave out with --skip"):
        import_job(room, job_of(room), name="oil", force=True, preview=False)
    look = import_job(room, job_of(room), name="oil", force=True, skip=("pendant",), preview=False)
    assert look.skipped == ("pendant",)
    fresh = export_job(room, job_of(room).with_name("again"), "generic", resolution=SIZE)
    paint(job_of(room).with_name("again"))
    import_job(room, job_of(room).with_name("again"), name="oil", force=True, preview=False)
    assert np.quantile(errors_in_texels(room, fresh), 0.99) < 0.75


def test_a_room_whose_only_painted_piece_is_gone_passes_its_check(room):
    names = [entry["name"] for entry in json.loads((job_of(room) / "job.json").read_text())["objects"]]
    others = [name for name in names if name != "pendant"]
    import_job(room, job_of(room), name="oil", skip=others, preview=False)
    with pytest.warns(UserWarning, match="pendant changed or gone since painted"):
        edit(room, small_graph().remove_node("pendant"), model=StandIn(), place=False).save(room.parent, preview=False)
    assert not check(room).errors


def test_an_edit_that_goes_elsewhere_takes_the_look_along(room, tmp_path):
    import_job(room, job_of(room), name="oil", preview=False)
    before = {path: path.read_bytes() for path in room.parent.rglob("*") if path.is_file()}
    graph = read_room(room).graph.update_node("pendant", category="wardrobe")
    made = edit(room, graph, model=StandIn(), shapes="boxes", place=False)
    with pytest.warns(UserWarning, match="pendant changed or gone since painted"):
        other = made.save(tmp_path / "far/away", preview=False)
    assert {path: path.read_bytes() for path in before} == before
    assert {path.relative_to(other.parent) for path in (other.parent / "looks").rglob("*") if path.is_file()} == {
        path.relative_to(room.parent) for path in before if "looks" in path.parts
    }
    assert material(other, "wardrobe") == "oil_wardrobe"
    assert material(other, "pendant") != "oil_pendant"
    assert not check(other).errors
    assert "looks/" not in str(json.loads((other.parent / "away.json").read_text())["files"])  # the user's own
    (other.parent / "looks/oil.usda").write_text("#usda 1.0\n")
    with pytest.warns(UserWarning, match=r"far/away/looks/oil.usda: is another look; that of .*bedroom is not taken"):
        made.save(other.parent, preview=False)
    assert (other.parent / "looks/oil.usda").read_text() == "#usda 1.0\n"


def test_an_edited_root_keeps_its_words_and_gets_the_look(room):
    text = room.read_text().replace('doc = "A room made by EchoUSD.', 'doc = "Mine. A room made by EchoUSD.')
    room.write_text(text)
    import_job(room, job_of(room), name="oil", preview=False)
    assert "Mine. A room" in room.read_text()
    generated(room, small_graph())
    assert "Mine. A room" in room.read_text()
    assert material(room, "wardrobe") == "oil_wardrobe"


def refused(room, text, **options):
    """An import that fails with a text and changes nothing."""
    top = room.parent
    before = {path: path.read_bytes() for path in top.rglob("*") if path.is_file()}
    with pytest.raises(ValueError, match=text):
        import_job(room, job_of(room), preview=False, **options)
    assert {path: path.read_bytes() for path in top.rglob("*") if path.is_file()} == before


def bomb(path):
    Image.new("1", (9000, 9000)).save(path)


@pytest.mark.parametrize(
    ("spoil", "text"),
    [
        (lambda path: path.write_bytes(b"no image"), "not an image that can be read"),
        (lambda path: path.write_bytes(b""), "0 bytes, allowed for an image"),
        (bomb, "9000 x 9000 pixels, allowed"),
        (lambda path: (path.unlink(), os.mkfifo(path)), "not a regular file, allowed: a result"),
        (lambda path: (path.unlink(), path.mkdir()), "not a regular file, allowed: a result"),
        (lambda path: (path.unlink(), path.symlink_to("/etc/hostname")), "is a link to /etc/hostname, outside of"),
    ],
)
def test_pictures_are_read_with_doubt(room, spoil, text):
    spoil(job_of(room) / "results/bed.png")
    refused(room, text)


def changed_entry(job, **values):
    path = job / "job.json"
    found = json.loads(path.read_text())
    found["objects"][-1].update(values)
    path.write_text(json.dumps(found))


def test_jobs_are_read_with_doubt(room):
    job = job_of(room)
    changed_entry(job, mesh="../../etc/passwd")
    refused(room, "names '../../etc/passwd', outside of")
    changed_entry(job, mesh="meshes/pendant.obj", topology="0" * 32)
    refused(room, "pendant has other meshes")
    changed_entry(job, name="ghost")
    refused(room, "ghost is gone; export again")
    changed_entry(job, name="bed")
    refused(room, "job.json: objects: 'bed' comes twice, allowed: each name once")
    changed_entry(job, name="a b")
    refused(room, "job.json: objects.*.name")
    (job / "job.json").write_text("[1, 2")
    refused(room, "job.json: the file is .* allowed: Invalid JSON")
    (job / "job.json").unlink()
    refused(room, "job.json: cannot be read")


def test_names_of_looks(room):
    for name in ("made", "3d", "a b", "a\n", "../x", "x" * 99):
        refused(room, "name is .*, allowed: letters, digits and _", name=name)
    refused(room, "--skip names chair, allowed: ", skip=("chair",))
    import_job(room, job_of(room), name="oil", preview=False)
    refused(room, "oil.usda: exists; choose another --name or use --force", name="oil")


def test_a_changed_layout_is_named(room):
    path = job_of(room) / "meshes/bed.obj"
    path.write_text(path.read_text().replace("vt 0.", "vt 0.1", 1))
    refused(room, "object 'bed': .*bed.obj has other texture coordinates than were exported")
    path.write_text("v 0 0 0\nvt 0 0\nf 1/1 1/1 1/2\n")
    refused(room, "bed.obj: a part without texture coordinates")
    path.write_text("v 0 0 0\nf 1 1 1\n")
    refused(room, "bed.obj: a part without texture coordinates .*, allowed: triangles with texture coordinates")


def test_nothing_painted_is_said(room):
    for path in (job_of(room) / "results").glob("*.png"):
        path.unlink()
    refused(room, "no results, expected results/<object>.glb or results/<object>.png")


def test_one_object_alone(room):
    for path in (job_of(room) / "results").glob("*.png"):
        if path.stem != "bed":
            path.unlink()
    look = import_job(room, job_of(room), name="bed_only", preview=False)
    assert look.painted == ("bed",)
    assert "wardrobe" in look.unpainted
    assert material(room, "bed") == "bed_only_bed"
    assert not material(room, "wardrobe").startswith("bed_only")


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda m: Unwrapped(m.points * (1, 1.5, 1), m.st, m.faces), "of the 12 that were given are not among them"),
        (lambda m: Unwrapped(m.points * (-1, 1, 1), m.st, m.faces), "are not among them"),
        (lambda m: Unwrapped(m.points, m.st, m.faces[:-1]), "11 triangles came back, and 1 of .* --skip wardrobe"),
        (lambda m: Unwrapped(m.points, m.st + 2, m.faces), "texture coordinates from 2.* came back, allowed: 0 to 1"),
    ],
)
def test_other_meshes_are_refused_by_name(change, text):
    mesh = box()
    with pytest.raises(ValueError, match=text):
        texture_coordinates(mesh, change(mesh), "wardrobe")


def box():
    shape = trimesh.creation.box((1.0, 2.0, 0.6))
    shape.apply_translation((0.2, 1.0, 0.1))
    shape.vertices[0] += (0.03, 0.02, 0.01)  # nothing alike on the other side
    return atlas.unwrap([[(np.asarray(shape.triangles), np.asarray(shape.faces))]], 256)[0]


def test_triangles_without_area_may_be_left_out():
    mesh = box()
    flat = Unwrapped(mesh.points, mesh.st, np.concatenate([mesh.faces, mesh.faces[:1, [0, 0, 1]]]))
    st = texture_coordinates(flat, mesh, "wardrobe")
    assert np.allclose(st[:-1], mesh.corners)
    assert np.isfinite(st).all()


def glb_with(mesh, change):
    import struct

    content = glb_bytes(mesh, "bed", Image.new("RGB", (8, 8)))
    length = struct.unpack_from("<I", content, 12)[0]
    tree = json.loads(content[20 : 20 + length])
    change(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + length :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            lambda t: t["images"][0].update(uri="../../secret.png"),
            "images name '../../secret.png', allowed: what is in",
        ),
        (lambda t: t.update(extensionsRequired=["KHR_draco_mesh_compression"]), "needs KHR_draco_mesh_compression"),
        (lambda t: t["accessors"][0].update(count=10**12), "an accessor counts 1000000000000, allowed"),
        (lambda t: t["meshes"].append({"primitives": [{"material": 7}]}), "2 materials, allowed: one"),
        (lambda t: t["bufferViews"][-1].update(byteLength=10**9), "bed.glb: no glb that can be read"),
        (lambda t: t["materials"][0]["pbrMetallicRoughness"].pop("baseColorTexture"), "has no base colour image"),
        (lambda t: t.update(meshes="none"), "bed.glb: not a binary glTF 2.0 file"),
        (lambda t: t["meshes"].append({"primitives": 5}), "bed.glb: not a binary glTF 2.0 file"),
        (lambda t: t["meshes"].append({"primitives": [{"material": [1]}]}), "bed.glb: not a binary glTF 2.0 file"),
    ],
)
def test_glbs_are_read_with_doubt(room, change, text):
    job = job_of(room)
    (job / "results/bed.glb").write_bytes(glb_with(job_mesh(job, _entry(job, "bed")), change))
    refused(room, text)


def _entry(job, name):
    from echousd.texturing.job import read_job

    return next(thing for thing in read_job(job).objects if thing.name == name)


def test_xatlas_is_asked_for(room, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xatlas", None)
    with pytest.raises(ValueError, match=r'texture coordinates need xatlas: pip install "echousd\[texture\]"'):
        export_job(room, tmp_path / "new", "generic")
    assert not (tmp_path / "new").exists()


def test_command(room, echousd_command, tmp_path):
    done = echousd_command("texture", "export", room, "-o", tmp_path / "out", "--for", "scenetex")
    assert done.code == 0, done.err
    assert "objects  7" in done.out
    assert (tmp_path / "out/run.sh").stat().st_mode & 0o100
    again = echousd_command("texture", "export", room, "-o", tmp_path / "out", "--for", "generic")
    assert again.code == 2
    assert "holds a job already; use --force to replace it, results included" in again.err
    wrong = echousd_command("texture", "export", room, "-o", tmp_path / "new", "--for", "photoshop")
    assert wrong.code == 2
    assert "allowed: scenetex, hunyuan, mvpainter, generic" in wrong.err
    back = echousd_command("texture", "import", room, job_of(room), "--name", "oil", "--skip", "bed", "--no-preview")
    assert back.code == 0, back.err
    assert "painted  6 objects; variant 'oil' of `looks` on the room" in back.out
    assert "as it was: bed (left out)" in back.out
