"""The rooms in other people's software, really run (`make clients`); each client has an environment of its own."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from environments import RELEASES, python_of, run, three
from pxr import Usd, UsdGeom, UsdLux, UsdPhysics, UsdShade

import echousd
from echousd.draw.views import LENSES
from echousd.exporting.formats import export
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.layers.simready import pack
from echousd.stage.read import read_graph

pytestmark = pytest.mark.clients
HERE = Path(__file__).parent


def bounds(room: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """World bounds of every object by name, as this OpenUSD sees them (Y up, metres)."""
    stage = Usd.Stage.Open(str(room))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    found = {}
    for prim in stage.GetPrimAtPath("/Room/Objects").GetChildren():
        box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
        found[prim.GetName()] = (np.array(box.GetMin()), np.array(box.GetMax()))
    return found


def visible_meshes(stage: Usd.Stage, top: Usd.Prim | None = None) -> dict[str, UsdGeom.Mesh]:
    """Visible meshes of furniture, small things and the shell by their paths, of all or at and below a prim."""
    meshes = (
        UsdGeom.Mesh(prim)
        for prim in Usd.PrimRange(top or stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
        if prim.IsA(UsdGeom.Mesh)
    )
    return {str(mesh.GetPath()): mesh for mesh in meshes if mesh.ComputePurpose() != UsdGeom.Tokens.guide}


def every_variant_once(room: Path, folder: Path) -> Iterator[Path]:
    """Copies of a room: the first chooses the first variant of every set, the second the second, to the largest set."""
    shutil.copytree(room.parent, folder)
    stage = Usd.Stage.Open(str(folder / room.name))
    sets = [(prim, name) for prim in stage.Traverse() for name in prim.GetVariantSets().GetNames()]
    choices = {(prim, name): prim.GetVariantSet(name).GetVariantNames() for prim, name in sets}
    for number in range(max(map(len, choices.values()))):
        for (prim, name), variants in choices.items():
            prim.GetVariantSet(name).SetVariantSelection(variants[min(number, len(variants) - 1)])
        chosen = folder / f"{number}.usda"
        stage.GetRootLayer().Export(str(chosen))
        yield chosen


@pytest.mark.parametrize("release", RELEASES)
def test_older_openusd_reads_the_same_room(release: str, rooms: list[Path], z_room: Path) -> None:
    # 24.3 to 24.8 know no UsdSemantics: echousd does not run on them, but its files say the same there
    python = python_of(f"usd-{release}")
    for room in (*rooms, z_room):
        there = json.loads(run(python, HERE / "pxr_read.py", room))
        graph = read_graph(room)
        assert there["version"] < list(Usd.GetVersion())
        assert there["composition_errors"] == []
        assert there["unbound"] == []
        assert set(there["objects"]) == set(graph.names)
        assert sorted(map(tuple, there["relations"])) == sorted(relation.triple for relation in graph.relations)
        for name, (low, high) in bounds(room).items():
            np.testing.assert_allclose(there["objects"][name]["low"], low, atol=1e-4)
            np.testing.assert_allclose(there["objects"][name]["high"], high, atol=1e-4)
            assert there["objects"][name]["labels"] == [graph.node(name).category]


def test_nvidia_validator_reports_no_issues(rooms: list[Path], tmp_path: Path) -> None:
    # all combinations of a room's variants are thousands: each is chosen once instead
    command = python_of("nvidia").with_name("nvidia_usd_validate")
    for number, room in enumerate(rooms):
        for file in (room, *every_variant_once(room, tmp_path / str(number))):
            assert "No issues found" in run(command, "--no-variants", file, accepted=(0, 1)), file


def test_nvidia_validator_reports_no_issues_of_a_home(home: Path) -> None:
    command = python_of("nvidia").with_name("nvidia_usd_validate")
    assert "No issues found" in run(command, "--no-variants", home, accepted=(0, 1))


def test_blender_imports_a_home(home: Path) -> None:
    check_meshes(blender(home), Usd.Stage.Open(str(home)))


def test_three_loads_a_home(home: Path, tmp_path: Path) -> None:
    there = json.loads(run("node", HERE / "three_load.mjs", three(), export(home, tmp_path / "home.usdz")))
    stage = Usd.Stage.Open(str(home))
    wanted = visible_meshes(stage)
    assert there["triangles"] == sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in wanted.values())
    assert {path.rpartition("/")[2] for path in wanted} <= set(there["objects"])


def test_materialx_makes_shaders_of_every_material(tmp_path: Path) -> None:
    options = echousd.RoomOptions(walls=True, ceiling=True, dress="full", materialx=True)
    made = echousd.generate("samples/study.usda", seed=5, shapes="boxes", options=options)
    room = made.save(tmp_path / "study", preview=False)
    found = json.loads(run(python_of("simready"), HERE / "materialx_check.py", room))
    assert found["nodes"] > 50
    assert found["wrong"] == []
    assert found["invalid"] == []
    assert len(set(found["shaders"].values())) == 1  # GLSL, ESSL, OSL and MDL of every material
    stage = Usd.Stage.Open(str(room))
    assert found["shaders"]["glsl"] == len(stage.GetPrimAtPath("/Room/Looks").GetChildren())
    # it runs on usd-core, which comes without UsdMtlx and knows no node of MaterialX
    said = run(python_of("nvidia").with_name("nvidia_usd_validate"), "--no-variants", room, accepted=(0, 1))
    assert all("shaderId 'ND_" in line for line in said.splitlines() if "validation:[" in line)


NUMBERED = re.compile(r"[.][0-9]{3}$")  # what keeps Blender's names apart


def blender(room: Path, client: str = "blender") -> dict[str, dict]:
    """What Blender makes of a room, by paths of names without the numbers that keep Blender's names apart."""
    lines = run(python_of(client), HERE / "blender_import.py", room).splitlines()
    things = {thing["name"]: thing for thing in (json.loads(line) for line in lines if line.startswith("{"))}
    found = {}
    for thing in things.values():
        path, above = "", thing
        while above:
            path = f"/{NUMBERED.sub('', above['name'])}{path}"
            above = things.get(above["parent"])
        assert path not in found or path == "/Openings", path  # of every room one at the top, see `check_blender`
        found[path] = thing
    return found


def in_blender(point: np.ndarray, stage: Usd.Stage) -> tuple[float, float, float]:
    """Y up in USD is Z up in Blender."""
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z:
        return point[0], point[1], point[2]
    return point[0], -point[2], point[1]


def bound_looks(mesh: UsdGeom.Mesh) -> set[str]:
    """Names of the materials bound to a mesh or to its parts."""
    parts = UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets() or [mesh]
    return {UsdShade.MaterialBindingAPI(p).ComputeBoundMaterial()[0].GetPrim().GetName() for p in parts}


def check_meshes(things: dict[str, dict], stage: Usd.Stage) -> None:
    """Every visible mesh of a stage, and no other, is in Blender: its corners in the world, its maps and materials."""
    placed, wanted = UsdGeom.XformCache(), visible_meshes(stage)
    assert {path for path, thing in things.items() if thing["type"] == "MESH"} == set(wanted)
    for path, mesh in wanted.items():
        part = things[path]
        assert part["faces"] == len(mesh.GetFaceVertexCountsAttr().Get()), path
        # Exact corners: the bounds of a turned object's local box are wider than the object.
        turn = np.array(placed.GetLocalToWorldTransform(mesh.GetPrim()))
        points = np.array(mesh.GetPointsAttr().Get(), float) @ turn[:3, :3] + turn[3, :3]
        corners = np.array([in_blender(point, stage) for point in points])
        np.testing.assert_allclose(part["low"], corners.min(0), atol=1e-3)
        np.testing.assert_allclose(part["high"], corners.max(0), atol=1e-3)
        st = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened())
        assert part["uv_layers"] == ["st"], path
        np.testing.assert_allclose(part["uv_spread"], np.ptp(st, 0), atol=1e-3)
        assert {NUMBERED.sub("", name) for name in part["materials"]} == bound_looks(mesh), path


def check_blender(file: Path, room: Path, client: str = "blender") -> None:
    """Every piece of a room, first and later users of an asset alike, arrives in Blender as the stage says.

    Arguments:
        file: what Blender imports, the room itself or an export of it.
        room: root layer of the room.
        client: which Blender.
    """
    things = blender(file, client)
    stage = Usd.Stage.Open(str(room))
    placed = UsdGeom.XformCache()
    wanted = visible_meshes(stage)
    # the openings' scope is below the graph's prim, which Blender passes over: an empty at the top
    assert {"/Room"} <= {path for path in things if path.count("/") == 1} <= {"/Room", "/Openings"}
    # furniture, small things and walls: each under its own name, in its place in the world
    owners = {prefixes[2] for prefixes in (mesh.GetPath().GetPrefixes() for mesh in wanted.values())}
    assert {path.name for path in owners} >= {*read_graph(room).names, "Floor"}
    for path in owners:
        thing = things[str(path)]
        assert (thing["type"], thing["name"]) == ("EMPTY", path.name)
        at = np.array(placed.GetLocalToWorldTransform(stage.GetPrimAtPath(path)))[3, :3]
        np.testing.assert_allclose(thing["position"], in_blender(at, stage), atol=1e-4)
    check_meshes(things, stage)
    cameras = {thing["name"]: thing for thing in things.values() if thing["type"] == "CAMERA"}
    assert set(cameras) == {"perspective", "top"}
    lens, sensor = cameras["perspective"]["lens"]
    assert min(LENSES) - 0.1 < lens * 36 / sensor < 35 + 0.1  # millimetres, of a picture as wide as film
    lights = {name.rpartition("/")[2]: thing["light"] for name, thing in things.items() if thing["type"] == "LIGHT"}
    for prim in stage.GetPrimAtPath("/Room/Lights").GetChildren():
        if prim.GetName() in lights:  # the sky is Blender's world
            colour = UsdLux.LightAPI(prim).GetColorAttr().Get()
            np.testing.assert_allclose(lights[prim.GetName()], list(colour), atol=1e-5, err_msg=prim.GetName())
    assert len(lights) >= 2
    box = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_]).ComputeWorldBound(stage.GetDefaultPrim())
    up = 2 if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else 1
    wide, deep = (box.ComputeAlignedRange().GetSize()[axis] for axis in (0, 3 - up))
    high, lens, sensor = cameras["top"]["position"][2], *cameras["top"]["lens"]
    seen = (high - box.ComputeAlignedRange().GetMax()[up]) * sensor / lens
    assert max(wide, deep) < seen < 1.5 * max(wide, deep)  # the whole room, and not much more


@pytest.mark.parametrize("client", ["blender", "blender42"])
def test_blender_imports_names_places_uvs_and_materials(client: str, rooms: list[Path], z_room: Path) -> None:
    for room in (*rooms, z_room):
        check_blender(room, room, client)


def test_blender_imports_the_package_for_the_web(rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        check_blender(export(room, tmp_path / f"{number}.usdz"), room)


def surfaces(stage: Usd.Stage, meshes: Iterable[UsdGeom.Mesh]) -> tuple[int, dict[str, int]]:
    """How many surfaces with a material there are, and how many of them read an image for each input."""
    inputs = {"map": "diffuseColor", "normalMap": "normal", "roughnessMap": "roughness"}
    count, read = 0, Counter[str]()
    for mesh in meshes:
        for part in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets() or [mesh]:
            shader = UsdShade.MaterialBindingAPI(part).ComputeBoundMaterial()[0].ComputeSurfaceSource()[0]
            count += 1
            for name, word in inputs.items():
                read[name] += bool(shader.GetInput(word) and shader.GetInput(word).HasConnectedSource())
    return count, dict(read)


@pytest.mark.parametrize("ending", [".usdz", "-arkit.usdz", ".usda"])
def test_three_loads_what_is_exported(ending: str, rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        arkit = ending.startswith("-arkit")
        package = export(room, tmp_path / f"{number}{ending}", arkit=arkit, physics=False)
        there = json.loads(run("node", HERE / "three_load.mjs", three(), package))
        stage = Usd.Stage.Open(str(room))
        wanted = visible_meshes(stage)
        assert there["triangles"] == sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in wanted.values())
        assert there["meshes"] >= len(wanted)
        assert there["withoutUv"] == []
        assert (len(there["materials"]), there["maps"]) == surfaces(stage, wanted.values())
        assert {path.rpartition("/")[2] for path in wanted} <= set(there["objects"])
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
        box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
        # three.js grows each mesh's own box with it when it is turned: never smaller, a little larger at most.
        assert (np.array(there["low"]) <= np.array(box.GetMin()) + 1e-3).all()
        assert (np.array(there["high"]) >= np.array(box.GetMax()) - 1e-3).all()
        np.testing.assert_allclose(there["low"], list(box.GetMin()), atol=0.25)
        np.testing.assert_allclose(there["high"], list(box.GetMax()), atol=0.25)


@pytest.mark.parametrize("ending", [".usdz", "-arkit.usdz", ".usda"])
def test_three_turns_rooms_with_z_up(ending: str, z_room: Path, tmp_path: Path) -> None:
    file = export(z_room, tmp_path / f"z{ending}", arkit=ending.startswith("-arkit"), physics=False)
    there = json.loads(run("node", HERE / "three_load.mjs", three(), file))
    stage = Usd.Stage.Open(str(z_room))
    wanted = visible_meshes(stage)
    assert there["triangles"] == sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in wanted.values())
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
    low, high = box.GetMin(), box.GetMax()
    np.testing.assert_allclose(there["low"], [low[0], low[2], -high[1]], atol=0.25)
    np.testing.assert_allclose(there["high"], [high[0], high[2], -low[1]], atol=0.25)


def opened(room: Path, folder: Path) -> Path:
    """A copy of a room whose doors stand open and whose drawers are pulled out."""
    shutil.copytree(room.parent, folder)
    stage = Usd.Stage.Open(str(folder / room.name))
    for prim in stage.Traverse():
        if prim.GetName().endswith("_door_hinge"):
            turn = next(a for a in prim.GetAttributes() if a.GetName().startswith("xformOp:rotate"))
            turn.Set(70.0)
        elif "_drawer_" in prim.GetName() and prim.IsA(UsdGeom.Xform):
            UsdGeom.Xformable(prim).AddTranslateOp(opSuffix="pulled").Set((0, 0, 0.2))
    stage.GetRootLayer().Save()
    return folder / room.name


@pytest.mark.parametrize("state", ["closed", "opened"])
def test_three_puts_every_component_of_a_glb_where_usd_has_it(state: str, rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        room = room if state == "closed" else opened(room, tmp_path / str(number))
        there = json.loads(run("node", HERE / "three_load.mjs", three(), export(room, tmp_path / f"{number}.glb")))
        stage = Usd.Stage.Open(str(room))
        checked = 0
        for path, (low, high) in there["boxes"].items():
            points = [np.zeros((0, 3))]
            for mesh in visible_meshes(stage, stage.GetPrimAtPath(path)).values():
                world = np.array(mesh.ComputeLocalToWorldTransform(0))
                points.append(np.array(mesh.GetPointsAttr().Get()) @ world[:3, :3] + world[3, :3])
            corners = np.concatenate(points)
            np.testing.assert_allclose([low, high], [corners.min(0), corners.max(0)], atol=1e-4, err_msg=path)
            checked += 1
        assert checked > 15
        assert {"map", "normalMap", "roughnessMap"} <= set(there["maps"])
        assert set(there["cameras"]) >= {"top", "perspective"}
        assert {"DirectionalLight", "PointLight", "SpotLight"} == set(there["lights"])


def rests(lines: str, room: Path) -> None:
    """Whether every body of a room that a client simulated for two seconds stays where it was, with its own mass."""
    moved = json.loads(lines.splitlines()[-1])["moved"]
    stage = Usd.Stage.Open(str(room))
    bodies = {str(prim.GetPath()): prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)}
    assert set(moved) == set(bodies)
    for path, (shift, turn, mass) in moved.items():
        assert shift < 0.01, (room, path)
        assert turn < 1.0, (room, path)
        assert mass == pytest.approx(UsdPhysics.MassAPI(bodies[path]).GetMassAttr().Get(), rel=1e-3), path


def test_rooms_rest_in_mujoco(rooms: list[Path], z_room: Path, tmp_path: Path) -> None:
    for number, room in enumerate((*rooms, z_room)):
        flat = export(room, tmp_path / f"{number}.usdc", pictures=False)
        rests(run(python_of("mujoco"), HERE / "mujoco_settle.py", flat), room)


def test_rooms_rest_in_newton(rooms: list[Path], z_room: Path, shared_room: Path) -> None:
    for room in (*rooms, z_room, shared_room):  # its first run compiles kernels for minutes
        rests(run(python_of("newton"), HERE / "newton_settle.py", room, timeout=1200), room)


def test_packages_pass_nvidia_as_well(rooms: list[Path], z_room: Path, shared_room: Path, tmp_path: Path) -> None:
    command = python_of("nvidia").with_name("nvidia_usd_validate")
    files = [z_room, shared_room]
    for number, room in enumerate(rooms):
        files += [export(room, tmp_path / f"{number}.usdz"), export(room, tmp_path / f"{number}.usdc")]
        files += [export(room, tmp_path / f"{number}-arkit.usdz", arkit=True)]
    for file in files:
        assert "No issues found" in run(command, "--no-variants", file, accepted=(0, 1)), file


def test_tinyusdz_reads_flat_rooms(rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        stage = Usd.Stage.Open(str(room))
        meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
        flat = export(room, tmp_path / f"{number}.usdc")
        there = json.loads(run(python_of("tinyusdz"), HERE / "tinyusdz_load.py", flat).splitlines()[-1])
        assert there["meshes"] == len(meshes)
        assert there["materials"] == len(
            {look for mesh in visible_meshes(stage).values() for look in bound_looks(mesh)}
        )


def test_khronos_finds_nothing_in_a_glb(rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        glb = export(room, tmp_path / f"{number}.glb")
        there = json.loads(run("node", HERE / "gltf_check.mjs", three(), glb))
        left = set(there["told"]) - {"MESH_PRIMITIVE_GENERATED_TANGENT_SPACE"}  # as every viewer does for normal maps
        assert not left, there["told"]


def test_usdchecker_finds_nothing_in_packages(rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        for arkit in (False, True):
            package = export(room, tmp_path / f"{number}{arkit}.usdz", arkit=arkit)
            options = ["--arkit"] if arkit else []
            there = json.loads(run(python_of("blender"), HERE / "usdchecker.py", package, *options).splitlines()[-1])
            assert there == {"errors": [], "failed": [], "warnings": []}


def test_omniverse_validator_reports_no_issues(rooms: list[Path]) -> None:
    command = python_of("omni").with_name("omni_asset_validate")
    for room in rooms:
        assert "No issues found" in run(command, "--no-variants", room, accepted=(0, 1)), room
    # At its defaults it walks through the product of all variants, which of a whole room takes most of an hour.
    assets = sorted(rooms[0].parent.glob("assets/[!s]*/"))[:3]
    for file in (folder / f"{folder.name}.usda" for folder in assets):
        assert "No issues found" in run(command, file, accepted=(0, 1)), file


def simready(file: Path, profile: str) -> set[str]:
    """Requirements that a file fails in one of SimReady's profiles, without those of optional features."""
    said = run(python_of("simready").with_name("simready-validate"), "--profile", profile, "-v", file, accepted=(0, 1))
    assert f"{profile} v" in said, said
    failing = [line.partition("failing requirements:")[2] for line in said.splitlines() if "failing req" in line]
    return {word for line in failing for word in re.findall(r"simready[.]([A-Z0-9.]+)", line)}


def test_packed_assets_are_simready_props(rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        layers, _, hangs = pack(room, tmp_path / str(number))
        hanging = {sentence.partition(":")[0] for sentence in hangs}
        assert layers
        for layer in layers:  # what hangs is no body, which two rules ask for
            wanted = {"RB.001", "SR.004"} if layer.stem in hanging else set()
            assert simready(layer, "Robotics-Prop") == wanted, layer


def test_rooms_pass_the_taxonomy_ade20k(rooms: list[Path], tmp_path: Path) -> None:
    for room in rooms:
        place = tmp_path / room.stem / "usd"
        shutil.copytree(room.parent, place)
        assert simready(place / room.name, "Open-Taxonomy-ADE20K") == set()


@pytest.mark.parametrize("client", ["mujoco", "newton"])
def test_drawers_and_doors_open_and_stay_within_their_limits(client: str, tmp_path: Path) -> None:
    nodes = [("wardrobe", "wardrobe", (1.6, 2.1, 0.6)), ("chest", "dresser", (0.9, 1.0, 0.45))]
    graph = SceneGraph(
        RoomSpec("bedroom", size=(4.0, 4.0)), tuple(Node(name, word, size=size) for name, word, size in nodes), ()
    )
    room = echousd.generate(graph, seed=1).save(tmp_path / "bedroom", preview=False)
    told = run(python_of(client), HERE / f"{client}_drawers.py", room, tmp_path / "flat.usdc", timeout=1200)
    found = json.loads(told.splitlines()[-1])  # others speak before
    assert max(found["moved"].values()) < 0.01
    assert {name.split("/")[3] for name in found["opened"]} == {"wardrobe", "chest"}
    for name, joint in found["opened"].items():
        low, high = joint["limit"]
        assert low - 0.01 < joint["to"] < 1.05 * high + 0.01, name
        assert joint["to"] > 0.8 * high, name
