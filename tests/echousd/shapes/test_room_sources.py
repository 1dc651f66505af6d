from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdPhysics, UsdShade
from small_room import BARE, StandIn, small_graph

import echousd
from echomodel.triangles import box
from echousd import options
from echousd.make.edit import edit
from echousd.make.reading import read_room
from echousd.shapes.geometry import Collider, Geometry, Origin, Part
from echousd.shapes.meshing import mesh_from_shape
from echousd.shapes.sources import mixing
from echousd.shapes.sources.source import Shapes, per_asset
from echousd.shapes.sources.whole import solid_geometry, within_budget
from echousd.stage.files import open_stage

ORIGIN = Origin("slabs", "CC-BY-4.0", "A. Joiner")


class Slabs:
    """A source of its own: a plate of two materials on a foot, each with a collider; remembers what it was asked."""

    def __init__(self):
        self.requests = []

    def check(self, model):
        if model.preset == "paper":
            raise ValueError("slabs are not for paper models")

    def shapes(self, request):
        self.requests.append(request)
        return per_asset(request, lambda row: self.made(np.asarray(request.boxes.size[row], float)))

    @staticmethod
    def made(size) -> Geometry:
        half = size / 2
        top = box((-half[0], half[1], -half[2]), (half[0], size[1], half[2]))
        foot = box((-0.3 * half[0], 0, -0.3 * half[2]), (0.3 * half[0], half[1], 0.3 * half[2]))
        parts = (
            Part("top", top, {"fabric": np.arange(6), "wood": np.arange(6, 12)}),
            Part("foot", foot, {"metal": np.arange(12)}),
        )
        colliders = (Collider("top_hull", top, "convexHull"), Collider("foot_hull", foot, "convexHull"))
        return Geometry(parts, colliders, ORIGIN)


@pytest.fixture
def slabs(monkeypatch):
    source = Slabs()
    monkeypatch.setitem(mixing.SOURCES, "slabs", mixing.ShapeSource(source.shapes, source.check))
    monkeypatch.setattr(options, "SHAPES", (*options.SHAPES, "slabs"))
    return source


def test_a_new_source_is_one_function_and_its_rows(slabs, tmp_path):
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), shapes="slabs", place=False, **BARE)
    root = room.save(tmp_path / "bedroom", preview=False)
    stage = open_stage(root)
    bed = "/Room/Objects/bed/geo"
    assert UsdGeom.Mesh(stage.GetPrimAtPath(f"{bed}/bed_foot"))
    for path, slot in {"bed_top/fabric": "fabric", "bed_top/wood": "wood", "bed_foot": "metal"}.items():
        bound = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(f"{bed}/{path}")).ComputeBoundMaterial()[0]
        assert bound.GetPath().name == f"room_{slot}"
    for name in ("bed_top_hull", "bed_foot_hull"):
        guide = stage.GetPrimAtPath(f"{bed}/{name}")
        assert UsdGeom.Mesh(guide).GetPurposeAttr().Get() == "guide"
        assert UsdPhysics.MeshCollisionAPI(guide).GetApproximationAttr().Get() == "convexHull"
    asset = Usd.Stage.Open(str(tmp_path / "bedroom/assets/bed/bed.usda")).GetRootLayer()
    assert asset.customLayerData["asset_license"] == "CC-BY-4.0"
    assert asset.customLayerData["asset_credit"] == "A. Joiner"
    manifest = read_room(root).manifest
    told = {"faces": 24, "watertight": True, "shapes": "slabs", "licence": "CC-BY-4.0", "credit": "A. Joiner"}
    assert manifest["shapes"] == "slabs"
    assert manifest["meshes"]["bed"] == told
    assert len(room.meshes["bed"].faces) == 24


def test_objects_that_share_an_asset_share_their_geometry(slabs):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="slabs", **BARE)
    assert room.geometry["nightstand_left"] is room.geometry["nightstand_right"]
    assert room.assets["nightstand_left"] == "nightstand"


def test_an_edit_asks_for_the_new_objects_and_reads_the_others_back(slabs, tmp_path):
    room = echousd.generate(small_graph(), seed=3, model=StandIn(), shapes="slabs", **BARE)
    root = room.save(tmp_path / "bedroom", preview=False)
    saved = read_room(root)
    for name, geometry in room.geometry.items():
        read = saved.geometry[name]
        assert [(p.name, sorted(p.slots)) for p in read.parts] == [(p.name, sorted(p.slots)) for p in geometry.parts]
        assert [(c.name, c.approximation) for c in read.colliders] == [
            (c.name, c.approximation) for c in geometry.colliders
        ]
        assert read.origin == ORIGIN
        np.testing.assert_allclose(read.mesh.bounds, geometry.mesh.bounds, atol=1e-5)
    graph = small_graph().add_node("chest", "wardrobe").relate("chest", "close_by", "bed")
    after = edit(root, graph, model=StandIn(), shapes="boxes")
    assert len(slabs.requests) == 1
    assert after.geometry["chest"].origin == Origin("boxes")
    assert after.geometry["bed"].origin == ORIGIN
    edit(root, graph, model=StandIn(), shapes="slabs", faces=321)
    request = slabs.requests[-1]
    assert (request.wanted, request.faces, set(request.kept)) == (("chest",), 321, set(small_graph().names))
    assert request.change is not None


def test_a_source_refuses_a_model_before_the_long_work(slabs):
    class Paper(StandIn):
        preset = "paper"

    model = Paper()
    with pytest.raises(ValueError, match="slabs are not for paper models"):
        echousd.generate(small_graph(), model=model, shapes="slabs", **BARE)
    assert model.edits == []


def test_unknown_sources_are_named():
    with pytest.raises(ValueError, match="shapes is 'lego', allowed: parts, sdf, boxes"):
        options.RoomOptions(shapes="lego")


def test_pieces_have_names_of_their_own():
    made = Slabs.made(np.ones(3))
    with pytest.raises(ValueError, match=r"pieces \['top', 'top', 'top_hull', 'foot_hull'\], need parts and colliders"):
        replace(made, parts=(made.parts[0], made.parts[0]))
    assert Shapes({"a": "b", "b": "b"}, {"b": made}).owners["a"] == "b"


def bed_grid() -> np.ndarray:
    """Signed distances of a bumpy slab with a headboard: many faces, and materials that meet inside."""
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, 64)] * 3, indexing="ij")
    bumps = 0.03 * np.sin(11 * x) * np.sin(13 * z)
    slab = np.maximum.reduce([np.abs(x) - 0.9, y + 0.1 + bumps, -y - 0.9, np.abs(z) - 0.9])
    head = np.maximum.reduce([np.abs(x) - 0.9, np.abs(y) - 0.9, z + 0.7, -z - 0.9])
    return (np.minimum(slab, head) * 8).clip(-1, 1).astype(np.float32)


@pytest.mark.parametrize("faces", [600, 2000])
def test_faces_are_counted_after_the_cut_along_materials(faces):
    grid, size = bed_grid(), np.array([1.6, 1.0, 2.0])
    uncut = mesh_from_shape(grid, size, faces=faces)
    assert solid_geometry(uncut, "double_bed", ORIGIN).faces > faces
    found = within_budget(grid, size, "double_bed", faces)
    assert 0.7 * faces < found.faces <= faces
    assert found.watertight
    assert len(found.parts[0].slots) > 1
