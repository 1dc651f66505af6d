"""Rules on what is no node of the graph: walls, floors, small things; and hints, switched-off colliders, normals."""

from pathlib import Path

import pytest
from pxr import Sdf, Usd, UsdGeom, UsdPhysics, Vt

from echousd.checks.reading import Reading
from echousd.checks.report import RULES, safely

GOOD = Path(__file__).parents[1] / "bad/good.usda"
LABELS = "semantics:labels:category"
TAXONOMIES = ("category", "ade20k")


@pytest.fixture
def stage():
    """The good room with a wall, a floor and a vase: boxes that collide."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(GOOD.read_text())
    for group, name, word in (("Shell", "Wall", "wall"), ("Shell", "Floor", "floor"), ("Dressing", "vase", "vase")):
        above = Sdf.CreatePrimInLayer(layer, f"/Room/{group}")
        above.specifier, above.typeName, above.kind = Sdf.SpecifierDef, "Xform", "group"
        path = f"/Room/{group}/{name}"
        Sdf.CopySpec(layer, "/Room/Objects/nightstand", layer, path)
        prim = layer.GetPrimAtPath(path)
        prim.SetInfo("apiSchemas", Sdf.TokenListOp.CreateExplicit(["SemanticsLabelsAPI:category"]))
        del prim.properties["echo:category"]
        prim.attributes[LABELS].default = Vt.TokenArray([word])
        prim.attributes["xformOp:translate"].default = (1.5, 0, 1.2)
        hint = Sdf.AttributeSpec(prim, "extentsHint", Sdf.ValueTypeNames.Float3Array)
        hint.default = Vt.Vec3fArray([(-0.25, 0, -0.2), (0.25, 0.6, 0.2)])
    return Usd.Stage.Open(layer)


def found(stage):
    """(rule, prim, message) of all that our rules find."""
    return [(rule.name, str(one.path), one.message) for rule in RULES for one in safely(rule, Reading(stage))]


def author(stage, path, value, kind=None):
    layer, path = stage.GetRootLayer(), Sdf.Path(path)
    spec = layer.GetAttributeAtPath(path)
    (spec or Sdf.AttributeSpec(layer.GetPrimAtPath(path.GetPrimPath()), path.name, kind)).default = value


def turn(stage, thing):
    author(stage, f"{thing}.xformOp:rotateX", 180.0, Sdf.ValueTypeNames.Float)
    author(stage, f"{thing}.xformOpOrder", Vt.TokenArray(["xformOp:translate", "xformOp:rotateX"]))


def test_the_room_is_good(stage):
    assert found(stage) == []


@pytest.mark.parametrize("thing", ["Shell/Wall", "Shell/Floor", "Dressing/vase"])
def test_what_the_graph_does_not_know_is_judged_too(stage, thing):
    path = f"/Room/{thing}"
    turn(stage, path)
    assert found(stage) == [("echo:Upright", path, "stands on its head, allowed: its own +Y (or +Z) upwards")]
    author(stage, f"{path}.xformOpOrder", Vt.TokenArray(["xformOp:translate"]))
    author(stage, f"{path}.{LABELS}", Vt.TokenArray(["rug", "vase"]))
    assert ("echo:OneLabel", path, f"{LABELS} is rug, vase, allowed: one word") in found(stage)


@pytest.mark.parametrize(("angle", "scale", "wrong"), [(180, 0.1, True), (95, 100, False), (180, 0, False)])
def test_small_things_stand_on_their_heads_in_any_scale(stage, angle, scale, wrong):
    path = "/Room/Dressing/vase"
    author(stage, f"{path}.xformOp:rotateX", float(angle), Sdf.ValueTypeNames.Float)
    author(stage, f"{path}.xformOp:scale", (scale, scale, scale), Sdf.ValueTypeNames.Double3)
    author(stage, f"{path}.xformOpOrder", Vt.TokenArray(["xformOp:translate", "xformOp:rotateX", "xformOp:scale"]))
    assert [one[1] for one in found(stage) if one[0] == "echo:Upright"] == [path] * wrong


@pytest.mark.parametrize("thing", ["Objects/bed", "Shell/Wall"])
def test_hints_are_the_boxes_of_what_is_shown(stage, thing):
    author(stage, f"/Room/{thing}.extentsHint", Vt.Vec3fArray([(0, 0, 0), (9, 9, 9)]), Sdf.ValueTypeNames.Float3Array)
    ((rule, path, message),) = found(stage)
    assert (rule, path) == ("echo:Extents", f"/Room/{thing}")
    assert message.startswith("extentsHint is (0, 0, 0) to (9, 9, 9), its meshes reach (-")


@pytest.mark.parametrize("mark", ["", "joint", "body", "variants"])
def test_what_stands_open_is_not_in_the_hint_of_what_it_belongs_to(stage, mark):
    layer, wall = stage.GetRootLayer(), "/Room/Shell/Wall"
    leaf = Sdf.CreatePrimInLayer(layer, f"{wall}/leaf")
    leaf.specifier, leaf.typeName = Sdf.SpecifierDef, "Xform"
    Sdf.CopySpec(layer, f"{wall}/nightstand_mesh", layer, f"{wall}/leaf/nightstand_mesh")
    Sdf.CopySpec(layer, f"{wall}/nightstand_collider", layer, f"{wall}/leaf/nightstand_collider")
    assert found(stage) == []
    UsdGeom.Xformable(stage.GetPrimAtPath(leaf.path)).AddTranslateOp().Set((0, 0, 0.5))
    if mark == "joint":
        UsdPhysics.RevoluteJoint.Define(stage, f"{wall}/hinge").CreateBody1Rel().SetTargets([leaf.path])
    elif mark == "body":
        stage.GetPrimAtPath(wall).RemoveAPI(UsdPhysics.RigidBodyAPI)
        UsdPhysics.RigidBodyAPI.Apply(stage.GetPrimAtPath(leaf.path))
    elif mark == "variants":
        stage.GetPrimAtPath(wall).GetVariantSets().AddVariantSet("articulation").AddVariant("static")
    findings = [(rule, path) for rule, path, _ in found(stage) if rule == "echo:Extents"]
    assert findings == ([] if mark else [("echo:Extents", wall)])
    author(stage, f"{wall}.extentsHint", Vt.Vec3fArray([(0, 0, 0), (9, 9, 9)]))
    assert ("echo:Extents", wall) in [(rule, path) for rule, path, _ in found(stage)]


def test_indices_of_normals_name_normals(stage):
    mesh = "/Room/Dressing/vase/nightstand_mesh"
    author(stage, f"{mesh}.primvars:normals", Vt.Vec3fArray([(0, 1, 0)]), Sdf.ValueTypeNames.Normal3fArray)
    stage.GetAttributeAtPath(f"{mesh}.primvars:normals").SetMetadata("interpolation", "faceVarying")
    author(stage, f"{mesh}.primvars:normals:indices", Vt.IntArray([0] * 23 + [5]), Sdf.ValueTypeNames.IntArray)
    assert found(stage) == [("echo:Normals", mesh, "primvars:normals:indices reach from 0 to 5, allowed: 0 to 0")]


@pytest.mark.parametrize(
    ("thing", "text"),
    [
        ("Objects/nightstand", "a rigid body without colliders: it falls through the floor"),
        ("Shell/Floor", "a floor without colliders: bodies fall through"),
        ("Shell/Wall", "a wall without colliders"),
    ],
)
@pytest.mark.parametrize("off", [True, False])
def test_colliders_are_there_and_switched_on(stage, thing, text, off):
    path = f"/Room/{thing}/nightstand_collider"
    if off:
        author(stage, f"{path}.physics:collisionEnabled", False, Sdf.ValueTypeNames.Bool)
    else:
        stage.GetRootLayer().GetPrimAtPath(path).ClearInfo("apiSchemas")
        author(stage, f"{path}.physics:approximation", None)
    assert ("echo:Colliders", f"/Room/{thing}", text) in found(stage)


def test_walls_are_labelled_walls(stage):
    path, layer = "/Room/Shell/Wall", stage.GetRootLayer()
    prim = layer.GetPrimAtPath(path)
    prim.SetInfo("apiSchemas", Sdf.TokenListOp.CreateExplicit([f"SemanticsLabelsAPI:{word}" for word in TAXONOMIES]))
    classes = Sdf.AttributeSpec(prim, "semantics:labels:ade20k", Sdf.ValueTypeNames.TokenArray)
    classes.default = Vt.TokenArray(["wall"])
    assert found(stage) == []
    classes.default = Vt.TokenArray(["bed"])
    told = "semantics:labels:ade20k is 'bed', allowed with 'wall': 'wall'"
    assert found(stage) == [("echo:LabelsAgree", path, told)]
    classes.default = Vt.TokenArray([])
    prim.attributes[LABELS].default = Vt.TokenArray(["floor"])
    assert ("echo:LabelsAgree", path, f"{LABELS} is 'floor', its name says 'wall'") in found(stage)
    (agree,) = (rule for rule in RULES if rule.name == "echo:LabelsAgree")
    assert [one.warning for one in safely(agree, Reading(stage))] == [False]
    prim.attributes[LABELS].default = Vt.TokenArray(["partition"])  # of somebody's own vocabulary
    assert [one.warning for one in safely(agree, Reading(stage))] == [True]


@pytest.mark.parametrize(
    ("name", "word"),
    [("SM_Lamp_Ceiling_01", "ceiling_lamp"), ("Cabinet_Door", "cabinet"), ("Clock_Wall", "clock")],
)
def test_names_that_share_a_word_with_their_label_agree(stage, name, word):
    layer, path = stage.GetRootLayer(), f"/Room/Shell/{name}"
    Sdf.CopySpec(layer, "/Room/Shell/Wall", layer, path)
    layer.GetPrimAtPath(path).attributes[LABELS].default = Vt.TokenArray([word])
    assert [one for one in found(stage) if one[0] == "echo:LabelsAgree"] == []
