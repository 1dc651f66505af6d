"""Rooms of other units, up axes and paths hold what ours hold, changed at its source: no prim stands for the change."""

import numpy as np
import pytest
from gltf_tree import read_gltf
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdPhysics
from small_room import StandIn, small_graph

import echousd
from echomodel.openings import Opening
from echousd.checks import check
from echousd.exporting.formats import export
from echousd.graph import RoomSpec
from echousd.make.reading import read_room
from echousd.options import RoomOptions
from echousd.stage.read import find_rooms
from echousd.stage.turning import rescale, turn_up

TURN = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # Y up -> Z up
DOOR = Opening("door", "door", 3, 0.4, 0.9, 2.0, hinge="right")
THEIRS = {"up_axis": "Z", "meters_per_unit": 0.01, "room_path": "/World/Flat/Living"}
WINDOW = Opening("window", "window", 0, 0.8, 1.4, 1.3, 0.9)


@pytest.fixture(scope="module")
def roots(tmp_path_factory):
    graph = small_graph().replaced(room=RoomSpec("bedroom", size=(4.0, 3.4), openings=(DOOR, WINDOW)))
    found = {}
    asked = {"Y": {}, "Z": {"up_axis": "Z"}, "theirs": THEIRS}
    for up, said in asked.items():
        options = RoomOptions(walls=True, dress="some", **said)
        room = echousd.generate(graph, seed=3, model=StandIn(), place=False, shapes="boxes", options=options)
        found[up] = room.save(tmp_path_factory.mktemp(up) / "bedroom", preview=False)
    return found


def world(prim):
    return np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T


def articulated(root):
    stage = Usd.Stage.Open(str(root))
    for prim in stage.Traverse():
        sets = prim.GetVariantSets()
        if "articulation" in sets.GetNames():
            sets.SetSelection("articulation", "articulated")
    return stage


def test_every_prim_is_where_it_was_turned(roots):
    y_up, z_up = (articulated(roots[up]) for up in ("Y", "Z"))
    assert UsdGeom.GetStageUpAxis(z_up) == "Z"
    layers = [layer for layer in z_up.GetUsedLayers() if not layer.anonymous]
    assert {layer.pseudoRoot.GetInfo("upAxis") for layer in layers} == {"Z"}
    assert not UsdGeom.Xformable(z_up.GetPrimAtPath("/Room")).GetOrderedXformOps()
    kinds = set()
    for prim in y_up.Traverse():
        there = z_up.GetPrimAtPath(prim.GetPath())
        assert there.GetTypeName() == prim.GetTypeName(), prim
        if prim.IsA(UsdGeom.Mesh):
            for name in ("points", "primvars:normals"):
                values = [np.array(p.GetAttribute(name).Get()) for p in (prim, there)]
                np.testing.assert_allclose(values[1], values[0] @ TURN.T, atol=1e-6)
            extents = [np.array(UsdGeom.Mesh(p).GetExtentAttr().Get()) for p in (prim, there)]
            np.testing.assert_allclose(extents[1], np.sort(extents[0] @ TURN.T, 0), atol=1e-6)
        if prim.IsA(UsdGeom.Xformable):
            before, after = world(prim), world(there)
            np.testing.assert_allclose(after[:3, 3], TURN @ before[:3, 3], atol=1e-5)
            aimed = prim.IsA(UsdGeom.Camera) or (prim.HasAPI(UsdLux.LightAPI) and not prim.IsA(UsdLux.SphereLight))
            own = np.eye(3) if aimed else TURN
            np.testing.assert_allclose(after[:3, :3] @ own, TURN @ before[:3, :3], atol=1e-5)
            kinds.add(str(prim.GetTypeName()))
        if prim.HasAPI(UsdPhysics.MassAPI):
            masses = [UsdPhysics.MassAPI(p) for p in (prim, there)]
            tensors = []
            for mass in masses:
                turn = np.array(Gf.Matrix3d(Gf.Rotation(Gf.Quatd(mass.GetPrincipalAxesAttr().Get())))).T
                tensors.append(turn @ np.diag(mass.GetDiagonalInertiaAttr().Get()) @ turn.T)
            np.testing.assert_allclose(tensors[1], TURN @ tensors[0] @ TURN.T, atol=1e-4)
        if prim.IsA(UsdPhysics.Joint):
            joints = [UsdPhysics.RevoluteJoint(p) for p in (prim, there)]
            places = [np.array(joint.GetLocalPos0Attr().Get()) for joint in joints]
            np.testing.assert_allclose(places[1], TURN @ places[0], atol=1e-6)
            axes = [np.array(Gf.Rotation(Gf.Quatd(j.GetLocalRot0Attr().Get())).TransformDir((1, 0, 0))) for j in joints]
            np.testing.assert_allclose(axes[1], TURN @ axes[0], atol=1e-6)
            kinds.add("joint")
    assert {"Mesh", "Xform", "Camera", "DomeLight", "RectLight", "DistantLight", "SphereLight", "joint"} <= kinds


def bounds(stage, room):
    """Path in the room -> corners (2, 3) in metres, +Z up, of everything that has a form; what bodies weigh as well."""
    metres, turn = UsdGeom.GetStageMetersPerUnit(stage), np.eye(3) if UsdGeom.GetStageUpAxis(stage) == "Z" else TURN
    boxes, cache = UsdGeom.BBoxCache(0, ["default", "guide"], useExtentsHint=False), UsdGeom.XformCache()
    found = {}
    for prim in stage.Traverse():
        path = str(prim.GetPath()).removeprefix(room)
        if prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdLux.BoundableLightBase):
            box = boxes.ComputeWorldBound(prim).ComputeAlignedRange()
            found[path] = np.sort(np.array([box.GetMin(), box.GetMax()]) @ turn.T * metres, 0)
        if prim.IsA(UsdGeom.Camera):
            seen = UsdGeom.Camera(prim).GetCamera().frustum
            found[path] = np.array([seen.nearFar.min * metres, seen.nearFar.max * metres, seen.window.max[0]])
        if prim.HasAPI(UsdPhysics.MassAPI):
            mass = UsdPhysics.MassAPI(prim)
            centre = cache.GetLocalToWorldTransform(prim).Transform(Gf.Vec3d(mass.GetCenterOfMassAttr().Get()))
            moments = np.array(mass.GetDiagonalInertiaAttr().Get()) * metres**2
            found[f"{path}.mass"] = np.array([turn @ np.array(centre) * metres, moments])
        if prim.IsA(UsdPhysics.PrismaticJoint):
            found[path] = UsdPhysics.PrismaticJoint(prim).GetUpperLimitAttr().Get() * metres
        if prim.IsA(UsdPhysics.Scene):
            found[path] = UsdPhysics.Scene(prim).GetGravityMagnitudeAttr().Get() * metres
        if prim.IsA(UsdLux.SphereLight):  # of which the size does not tell how much it shines
            found[f"{path}.power"] = UsdLux.SphereLight(prim).GetIntensityAttr().Get() * metres**2
    return found


def test_with_another_unit_and_path_everything_is_as_large_as_it_was(roots):
    ours, theirs = (articulated(roots[up]) for up in ("Y", "theirs"))
    assert (UsdGeom.GetStageMetersPerUnit(theirs), UsdGeom.GetStageUpAxis(theirs)) == (0.01, "Z")
    assert str(theirs.GetDefaultPrim().GetPath()) == "/World"
    assert [str(prims.room.GetPath()) for prims in find_rooms(theirs)] == ["/World/Flat/Living"]
    layers = [layer for layer in theirs.GetUsedLayers() if not layer.anonymous]
    assert {layer.pseudoRoot.GetInfo("metersPerUnit") for layer in layers} == {0.01}
    assert not any("xformOp:scale" in layer.ExportToString() for layer in layers)
    wanted, found = bounds(ours, "/Room"), bounds(theirs, "/World/Flat/Living")
    assert {path for path in wanted if path.endswith((".mass", ".power"))}
    assert found.keys() == wanted.keys()
    for path, value in wanted.items():
        np.testing.assert_allclose(found[path], value, atol=1e-5, rtol=1e-5, err_msg=path)


def test_joints_of_drawers_slide_as_far_in_another_unit():
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    for kind, limit in ((UsdPhysics.PrismaticJoint, 0.4), (UsdPhysics.RevoluteJoint, 90.0)):
        joint = kind.Define(stage, f"/{kind.__name__}")
        joint.CreateUpperLimitAttr(limit)
        joint.GetPrim().CreateAttribute("newton:friction", Sdf.ValueTypeNames.Float).Set(2.0)
        way = "linear" if limit < 1 else "angular"
        UsdPhysics.DriveAPI.Apply(joint.GetPrim(), way).CreateMaxForceAttr(2.0)
    rescale(layer, 0.01)
    for name, force in (("newton:friction", 200.0), ("drive:linear:physics:maxForce", 200.0)):
        assert stage.GetPrimAtPath("/PrismaticJoint").GetAttribute(name).Get() == pytest.approx(force)
    for name, force in (("newton:friction", 2e4), ("drive:angular:physics:maxForce", 2e4)):
        assert stage.GetPrimAtPath("/RevoluteJoint").GetAttribute(name).Get() == pytest.approx(force)
    assert stage.GetPrimAtPath("/PrismaticJoint").GetAttribute("physics:upperLimit").Get() == pytest.approx(40.0)
    assert stage.GetPrimAtPath("/RevoluteJoint").GetAttribute("physics:upperLimit").Get() == 90.0
    once = layer.ExportToString()
    assert rescale(layer, 0.01).ExportToString() == once


@pytest.mark.parametrize(
    ("schema", "power", "names"),
    [
        ("Camera", 1, ("focalLength", "focusDistance", "horizontalAperture", "verticalAperture",
                       "horizontalApertureOffset", "verticalApertureOffset", "clippingRange")),
        ("SphereLight", 1, ("inputs:radius",)), ("RectLight", 1, ("inputs:width", "inputs:height")),
        ("PhysicsScene", 1, ("physics:gravityMagnitude",)),
        ("Mesh", 1, ("points", "extent")),
        ("Xform", 1, ("physics:centerOfMass",)), ("Xform", 2, ("physics:diagonalInertia",)),
        ("Xform", -3, ("physics:density",)), ("Xform", 0, ("physics:mass", "inputs:intensity")),
    ],
)  # fmt: skip
def test_what_is_measured_in_lengths_is_rescaled_by_as_many_as_it_has(schema, power, names):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    spec = Sdf.CreatePrimInLayer(layer, "/it")
    spec.typeName = schema
    kinds = {"points": "point3f[]", "extent": "float3[]", "clippingRange": "float2",
             "physics:centerOfMass": "point3f", "physics:diagonalInertia": "float3"}  # fmt: skip
    ones = {"float2": Gf.Vec2f(1), "point3f": Gf.Vec3f(1), "float3": Gf.Vec3f(1), "float": 1.0}
    for name in names:
        kind = kinds.get(name, "float")
        attribute = Sdf.AttributeSpec(spec, name, Sdf.ValueTypeNames.Find(kind))
        attribute.default = ones.get(kind, [Gf.Vec3f(1)])
    rescale(layer, 0.1)
    for name in names:
        found = np.array(spec.attributes[name].default, float)
        np.testing.assert_allclose(found, np.full(found.shape, 10.0**power), rtol=1e-5, err_msg=name)


def test_a_matrix_above_a_model_of_others_scales_it_and_others_only_move():
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    pose = Gf.Matrix4d().SetScale(0.5) * Gf.Matrix4d().SetTranslate((1, 2, 3))
    for name, files in (("theirs", ("model.usd", "")), ("ours", ("ours_geo.usdc",)), ("bare", ("",))):
        spec = Sdf.CreatePrimInLayer(layer, f"/{name}")
        attribute = Sdf.AttributeSpec(spec, "xformOp:transform", Sdf.ValueTypeNames.Matrix4d)
        attribute.default = pose
        for number, file in enumerate(files):
            child = Sdf.CreatePrimInLayer(layer, f"/{name}/part_{number}")
            if file:
                child.payloadList.prependedItems.append(Sdf.Payload(file, "/model"))
    rescale(layer, 0.01, theirs=lambda path: path == "model.usd")
    assert layer.pseudoRoot.GetInfo("metersPerUnit") == 0.01
    found = {name: np.array(layer.GetAttributeAtPath(f"/{name}.xformOp:transform").default) for name in
             ("theirs", "ours", "bare")}  # fmt: skip
    for name, side in (("theirs", 50.0), ("ours", 0.5), ("bare", 0.5)):
        np.testing.assert_allclose(found[name], [*np.diag([side] * 3 + [0])[:3], (100, 200, 300, 1)], atol=1e-9)


@pytest.mark.parametrize("other", ["Z", "theirs"])
def test_it_passes_check_and_is_read_and_edited_like_the_other(roots, tmp_path, other):
    assert not check(roots[other]).errors
    y_up, z_up = (read_room(roots[up]) for up in ("Y", other))
    np.testing.assert_allclose(z_up.boxes.position, y_up.boxes.position, atol=1e-5)
    np.testing.assert_allclose(z_up.boxes.yaw, y_up.boxes.yaw, atol=1e-5)
    for name, geometry in y_up.geometry.items():
        np.testing.assert_allclose(z_up.geometry[name].mesh.bounds, geometry.mesh.bounds, atol=1e-6)
        if geometry.mass is not None:
            np.testing.assert_allclose(z_up.geometry[name].mass.centre, geometry.mass.centre, atol=1e-6)
    for up, root in ((up, roots[up]) for up in ("Y", other)):
        graph = read_room(root).graph.relate("wardrobe", "bigger_than", "lamp").add_node("stool", "nightstand")
        made = echousd.edit(root, graph, model=StandIn(), shapes="boxes")
        made.save(tmp_path / up / "bedroom", preview=False)
    y_up, z_up = (read_room(tmp_path / up / "bedroom" / "bedroom.usda") for up in ("Y", other))
    np.testing.assert_allclose(z_up.boxes.position, y_up.boxes.position, atol=1e-5)
    wanted, found = (articulated(tmp_path / up / "bedroom" / "bedroom.usda") for up in ("Y", other))
    room = str(find_rooms(found)[0].room.GetPath())
    above = len(Sdf.Path(room).GetPrefixes()) - 1
    paths = [str(prim.GetPath()).replace(room, "/Room", 1) for prim in found.Traverse()]
    assert [str(prim.GetPath()) for prim in wanted.Traverse()] == paths[above:]


@pytest.mark.parametrize("other", ["Z", "theirs"])
def test_a_glb_is_the_same(roots, tmp_path, other):
    y_up, z_up = (read_gltf(export(roots[up], tmp_path / f"{up}.glb")) for up in ("Y", other))
    names = [[node["name"] for node in gltf.tree["nodes"]] for gltf in (y_up, z_up)]
    assert {*names[0]} - {"Room"} <= {*names[1]}
    there = {path.replace(THEIRS["room_path"], "/Room", 1): number for path, number in z_up.by_id().items()}
    for one, two in ((number, there[path]) for path, number in y_up.by_id().items()):
        corners = [gltf.triangles(number).reshape(-1, 3) for gltf, number in ((y_up, one), (z_up, two))]
        np.testing.assert_allclose(*([at.min(0), at.max(0)] for at in corners if len(at)), atol=1e-4)


def test_a_layer_is_turned_once_and_foreign_transforms_are_refused():
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.Xform.Define(stage, "/a").AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    once = turn_up(layer).ExportToString()
    assert "(1, -3, 2)" in once
    assert turn_up(layer).ExportToString() == once
    other = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(other)
    UsdGeom.Xform.Define(stage, "/a").AddRotateXYZOp().Set(Gf.Vec3f(1, 2, 3))
    with pytest.raises(ValueError, match="</a>: xformOp:rotateXYZ cannot be turned, allowed: rotateY, rotateZ"):
        turn_up(other)
