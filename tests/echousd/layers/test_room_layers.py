import json
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdShade, UsdUtils, UsdValidation
from small_room import BARE, OBJECTS, StandIn, small_graph

import echousd
from echomodel.boxes import Boxes
from echousd.checks.physics_rules import gravity
from echousd.checks.reading import Reading
from echousd.dressing.dress import dress
from echousd.layers.compose import _asset as made
from echousd.layers.compose import room_files, simready_data
from echousd.layers.materials import define_material, look_images, tint_factor, write_palettes
from echousd.layers.materialx import write_networks
from echousd.layers.placed import MODEL, PLACES, attribution, carried_files
from echousd.options import RoomOptions
from echousd.settle.settle import read_world
from echousd.shapes.finishes.baking import hexadecimal
from echousd.shapes.geometry import Origin, Original
from echousd.shapes.hulls import hull_volume
from echousd.shapes.looks import Look, look
from echousd.stage.boxes import read_dressing
from echousd.stage.labels import labels
from echousd.stage.paths import asset_file, piece_name
from echousd.stage.pen import Pen
from echousd.stage.read import read_graph

SPECIAL = {"inputs:opacity", "inputs:emissiveColor"}
SEEN = {"wood": set(), "glass": {"inputs:opacity"}, "shade": {"inputs:emissiveColor"}}


@pytest.fixture(scope="module")
def room():
    return echousd.generate(small_graph(), seed=3, model=StandIn(), place=False, faces=800, **BARE)


@pytest.fixture(scope="module")
def root(room, tmp_path_factory):
    return room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


@pytest.fixture
def stage(root):
    return Usd.Stage.Open(str(root))


def test_files_are_those_of_the_design(root):
    found = {str(path.relative_to(root.parent)) for path in root.parent.rglob("*") if path.is_file()}
    layers = {f"layers/{name}.usda" for name in ("materials", "physics", "layout", "graph", "geometry")}
    layers.add("layers/shell.usdc")
    names = set(OBJECTS) - {"nightstand_left", "nightstand_right"} | {"nightstand"}
    assets = {f"assets/{n}/{n}{end}" for n in names for end in (".usda", "_geo.usdc")}
    images = {path for path in found if path.startswith("textures/") and path.endswith(".jpg")}
    assert any(path.startswith(("textures/planks_", "textures/herringbone_")) for path in images)
    assert found == {"bedroom.usda", "bedroom.json"} | images | layers | assets


def test_assets_of_ours_name_nobody_and_those_of_others_their_author(stage, root):
    for path in root.parent.glob("assets/*/*.usda"):
        data = Sdf.Layer.FindOrOpen(str(path)).customLayerData
        assert data["asset_license"] == "Apache-2.0"
        assert "asset_credit" not in data
    origins = {"sofa": Origin("library", "CC-BY-4.0", "A Person", "sofa.glb"), "bed": Origin("library", "CC0-1.0")}
    assert attribution("bedroom", origins).splitlines()[-2:] == [
        "| sofa | sofa.glb | CC-BY-4.0 | A Person |",
        "| bed |  | CC0-1.0 | unknown |",
    ]


def test_paintings_keep_their_colours():
    base, look = Look((0.5, 0.4, 0.2)), Look((0.25, 0.4, 0.1))
    assert tint_factor(base, look) == [0.5, 1.0, 0.5]
    assert tint_factor(replace(base, pattern="picture_fern"), look) == [1.0, 1.0, 1.0]


def test_factors_of_a_tint_are_told_to_four_digits_and_black_is_no_divisor():
    assert tint_factor(Look((0.0, 0.3, 0.7)), Look((0.1, 0.1, 0.2))) == [1000.0, 0.3333, 0.2857]


def test_pictures_of_materials_are_called_after_what_they_show():
    planks = look("oak", "floor")
    files = {
        name: path for name, (path, _) in look_images(replace(planks, metres=0.256, roughness=0.437), "oak").items()
    }
    tint, worn = hexadecimal(planks.color), f"worn{1000 * planks.worn:.0f}"
    assert files == {
        "diffuseColor": f"textures/{planks.pattern}_{tint}_{worn}.jpg",
        "normal": f"textures/{planks.pattern}_26cm_normal.jpg",
        "roughness": f"textures/{planks.pattern}_44_roughness.jpg",
    }  # fmt: skip


def test_equal_images_of_prints_are_one_file():
    """Many sheets look the same in several harmonies, and cushions are of one cloth whatever is printed on them."""
    prints = [look("oak", slot) for slot in ("picture_sea", "cushion_fern", "cushion_blocks")]
    sea, fern, blocks = (look_images(one, "oak") for one in prints)
    assert look_images(prints[0], "olive") == sea
    assert look_images(prints[1], "olive")["diffuseColor"][0] != fern["diffuseColor"][0]
    assert fern["normal"] == blocks["normal"]
    assert fern["diffuseColor"] != blocks["diffuseColor"]


def test_a_model_that_is_carried_along_keeps_its_bytes_but_for_where_another_lies(tmp_path):
    own = Original(np.eye(4), "/chair", files={"chair.usd": b""})
    files = {asset_file("chair"): b"#usda 1.0\n"}
    assert carried_files("chair", own, files, tmp_path) == files
    outside, folder = replace(own, layer=tmp_path / "models/chair.usd", files={}), tmp_path / "r/assets/chair"
    layer = Sdf.Layer.CreateAnonymous(".usda")
    spec = Sdf.CreatePrimInLayer(layer, f"/chair/{piece_name('chair', PLACES)}/{piece_name('chair', MODEL)}")
    spec.payloadList.prependedItems = [Sdf.Payload("../../elsewhere.usd", "/chair")]
    moved = carried_files("chair", outside, {asset_file("chair"): layer.ExportToString().encode()}, folder)
    layer.ImportFromString(moved[asset_file("chair")].decode())
    (payload,) = layer.GetPrimAtPath(spec.path).payloadList.prependedItems
    assert (payload.assetPath, payload.primPath) == ("../../../models/chair.usd", "/chair")
    assert carried_files("chair", outside, moved, folder) == moved


def test_only_glass_is_seen_through_and_only_shades_glow():
    pen = Pen.blank("Looks")
    for slot in ("wood", "glass", "shade"):
        define_material(pen, f"/Looks/{slot}", look("oak", slot))
    written = {slot: {p.name for p in pen.layer.GetPrimAtPath(f"/Looks/{slot}/surface").properties} for slot in SEEN}
    assert {slot: SPECIAL & names for slot, names in written.items()} == SEEN


def test_stage_opens_whole_and_carries_its_graph(stage, room):
    assert stage.GetCompositionErrors() == []
    assert stage.GetDefaultPrim().GetPath() == "/Room"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    assert read_graph(stage) == room.graph


def test_every_default_validator_is_content(stage):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetMessage() for error in errors] == []


def test_objects_stand_where_their_boxes_are(stage, room):
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    for number, name in enumerate(room.names):
        prim = stage.GetPrimAtPath(f"/Room/Objects/{name}")
        matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)).T
        np.testing.assert_allclose(matrix, room.pose(number), atol=1e-4)
        box = cache.ComputeUntransformedBound(prim).GetRange()
        x, y, z = room.boxes.size[number].tolist()
        np.testing.assert_allclose([box.GetMin(), box.GetMax()], [[-x / 2, 0, -z / 2], [x / 2, y, z / 2]], atol=1e-4)


def test_kinds_payloads_and_hints(stage):
    kinds = {
        str(prim.GetPath()): Usd.ModelAPI(prim).GetKind() for prim in stage.Traverse() if Usd.ModelAPI(prim).GetKind()
    }
    assert kinds.pop("/Room") == "assembly"
    assert kinds.pop("/Room/Objects") == kinds.pop("/Room/Shell") == "group"
    assert set(kinds.values()) == {"component"}
    for path in kinds:
        hint = UsdGeom.ModelAPI(stage.GetPrimAtPath(path)).GetExtentsHint()
        assert len(hint) == 2
    unloaded = Usd.Stage.Open(stage.GetRootLayer(), Usd.Stage.LoadNone)
    assert not unloaded.GetPrimAtPath("/Room/Objects/bed/geo/bed_mesh").IsA(UsdGeom.Mesh)
    unloaded.Load("/Room/Objects/bed")
    assert unloaded.GetPrimAtPath("/Room/Objects/bed/geo/bed_mesh").IsA(UsdGeom.Mesh)


def test_style_group_shares_one_asset(stage, room):
    assert room.assets["nightstand_right"] == room.assets["nightstand_left"] == "nightstand"
    assert room.geometry["nightstand_right"] is room.geometry["nightstand_left"]
    assert stage.GetPrimAtPath("/Room/Objects/nightstand_right/geo/nightstand_mesh")


def test_meshes_have_a_transform_of_their_own(stage):
    """Else Blender makes one object of an Xform and its only mesh, under the mesh's name."""
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            (op,) = UsdGeom.Xformable(prim).GetOrderedXformOps()
            assert op.GetPrecision() == UsdGeom.XformOp.PrecisionFloat
            assert op.Get() == (0, 0, 0)


def test_layout_layer_holds_transforms_alone(root):
    stage = Usd.Stage.Open(str(root.parent / "layers/layout.usda"))
    for prim in stage.TraverseAll():
        assert not prim.IsDefined()
        assert all(p.GetName().startswith("xformOp") for p in prim.GetAuthoredProperties())


def test_every_path_in_the_room_is_relative(root):
    layers, _, unresolved = UsdUtils.ComputeAllDependencies(str(root))
    assert unresolved == []
    assert len(layers) == 7 + 2 * 5
    for path in root.parent.rglob("*.usda"):
        assert "@/" not in path.read_text()
        assert str(root.parent) not in path.read_text()


def test_meshes_have_normals_uvs_and_materials(stage):
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    shown = [mesh for mesh in meshes if mesh.ComputePurpose() == "default"]
    assert len(shown) == len(OBJECTS) + 1
    for mesh in meshes:
        assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
        faces, corners = mesh.GetFaceVertexCountsAttr().Get(), mesh.GetFaceVertexIndicesAttr().Get()
        each = {"normals": ("faceVarying", len(corners)), "st": ("faceVarying", len(corners))}
        if mesh.ComputePurpose() == "guide":  # what is bumped into has edges and no picture
            each = {"normals": ("uniform", len(faces)), "st": ("faceVarying", 3 * len(faces))}
        for name, (interpolation, count) in each.items():
            primvar = UsdGeom.PrimvarsAPI(mesh).GetPrimvar(name)
            assert primvar.GetInterpolation() == interpolation
            assert len(primvar.ComputeFlattened()) == count
            assert primvar.IsIndexed()
    for mesh in shown:
        subsets = UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets()
        faces = sorted(i for s in subsets for i in s.GetIndicesAttr().Get())
        assert not subsets or faces == list(range(len(mesh.GetFaceVertexCountsAttr().Get())))
        for prim in [s.GetPrim() for s in subsets] or [mesh.GetPrim()]:
            material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
            assert material
            assert str(material.GetPath()).startswith("/Room/Looks/")
            assert material.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"


def test_asset_opened_alone_has_looks_of_its_own(root):
    stage = Usd.Stage.Open(str(root.parent / "assets/bed/bed.usda"))
    for group, word in (("wood", "wood"), ("linen", "linen"), ("blanket", "wool")):
        subset = stage.GetPrimAtPath(f"/bed/geo/bed_mesh/{group}")
        material = UsdShade.MaterialBindingAPI(subset).ComputeBoundMaterial()[0]
        assert material.GetPath() == f"/bed/mtl/{group}"
        assert list(material.GetPrim().GetAttribute("semantics:labels:material").Get()) == [word]


def test_asset_is_what_studios_expect(root):
    file = str(root.parent / "assets/bed/bed.usda")
    bare = Usd.Stage.Open(file, Usd.Stage.LoadNone)
    behind = [prim for prim in bare.TraverseAll() if prim.IsA(UsdGeom.Mesh) or prim.GetName() == "wood"]
    assert behind == []  # geometry and materials are behind the payload
    stage = Usd.Stage.Open(file)
    bed = stage.GetPrimAtPath("/bed")
    assert [str(prim.GetTypeName()) for prim in (bed.GetChild("geo"), bed.GetChild("mtl"))] == ["Scope", "Scope"]
    assert bed.GetInherits().GetAllDirectInherits() == ["/_class_/bed"]
    assert stage.GetPrimAtPath("/_class_/bed").GetSpecifier() == Sdf.SpecifierClass
    assert bed.GetVariantSet("LOD").GetVariantNames() == ["high", "proxy"]
    palettes = bed.GetVariantSet("palette")
    color = stage.GetAttributeAtPath("/bed/mtl/wood/surface.inputs:diffuseColor")
    seen = set()
    for name in palettes.GetVariantNames():
        palettes.SetVariantSelection(name)
        seen.add(tuple(color.Get()))
    assert len(seen) == len(palettes.GetVariantNames()) == 6
    # the proxy: colliders are seen in place of the meshes, with a material
    bed.GetVariantSet("LOD").SetVariantSelection("proxy")
    shown = [
        prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)
        and UsdGeom.Imageable(prim).ComputeVisibility() != "invisible"
        and UsdGeom.Imageable(prim).ComputePurpose() == "default"
    ]  # fmt: skip
    assert shown
    assert all(prim.GetName().startswith("bed_collider") for prim in shown)
    assert UsdShade.MaterialBindingAPI(shown[0]).ComputeBoundMaterial()[0]


def test_nightstands_share_looks_and_styles_differ_from_the_room(stage):
    def bound(path):
        return UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(path)).ComputeBoundMaterial()[0].GetPrim().GetName()

    left = bound("/Room/Objects/nightstand_left/geo/nightstand_mesh/wood")
    assert left == bound("/Room/Objects/nightstand_right/geo/nightstand_mesh/wood") == "set_nightstand_left_wood"
    assert bound("/Room/Objects/wardrobe/geo/wardrobe_mesh/wood") == "room_wood"


def test_semantics(stage):
    labels = {}
    for prim in stage.Traverse():
        if prim.HasAPI(UsdSemantics.LabelsAPI, "category"):
            labels[prim.GetName()] = {
                n: UsdSemantics.LabelsAPI(prim, n).GetLabelsAttr().Get()[0] for n in ("category", "ade20k")
            }
    assert labels["nightstand_left"] == {"category": "nightstand", "ade20k": "chest of drawers"}
    assert labels["Floor"] == {"category": "floor", "ade20k": "floor"}
    assert set(labels) == set(OBJECTS) | {"Floor"}


def test_physics(stage):
    bodies = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    assert {prim.GetName() for prim in bodies} == set(OBJECTS) - {"pendant"}  # what hangs does not fall
    for prim in bodies:
        assert 0.2 <= UsdPhysics.MassAPI(prim).GetMassAttr().Get() <= 300
        above = prim.GetParent()
        while above:
            assert not above.HasAPI(UsdPhysics.RigidBodyAPI)
            above = above.GetParent()
    colliders = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.CollisionAPI)]
    approximation = {p.GetName(): UsdPhysics.MeshCollisionAPI(p).GetApproximationAttr().Get() for p in colliders}
    assert approximation.pop("Floor_mesh") == "none"
    assert set(approximation.values()) <= {"convexHull", *(() if find_spec("coacd") else ("convexDecomposition",))}
    assert len(colliders) >= len(OBJECTS) + 1  # what is hollow has several
    assert len([p for p in stage.Traverse() if p.IsA(UsdPhysics.Scene)]) == 1


def test_every_body_has_a_mass_that_engines_take(stage):
    for prim in stage.Traverse():
        if prim.HasAPI(UsdPhysics.RigidBodyAPI):
            mass = UsdPhysics.MassAPI(prim)
            moments = sorted(mass.GetDiagonalInertiaAttr().Get())
            assert 0 < moments[0] <= moments[2] <= (moments[0] + moments[1]) * 1.001, prim
            contact = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0]
            friction = UsdPhysics.MaterialAPI(contact)
            assert friction.GetStaticFrictionAttr().Get() >= friction.GetDynamicFrictionAttr().Get() > 0, prim
            assert friction.GetDensityAttr().Get() > 0


def test_an_asset_is_complete_by_itself(root):
    alone = Usd.Stage.Open(str(root.parent / "assets/bed/bed.usda"))
    bed = alone.GetDefaultPrim()
    assert bed.HasAPI(UsdPhysics.RigidBodyAPI)
    assert bed.GetAttribute("semantics:labels:category").Get() == ["double_bed"]
    colliders = [p for p in alone.Traverse() if p.HasAPI(UsdPhysics.CollisionAPI)]
    assert colliders
    assert all(p.GetName().startswith("bed_collider") for p in colliders)
    meshes = Sdf.Layer.FindOrOpen(str(root.parent / "assets/bed/bed_geo.usdc"))  # what they are is told where they are
    assert all("PhysicsCollisionAPI" in str(meshes.GetPrimAtPath(p.GetPath()).GetInfo("apiSchemas")) for p in colliders)
    assert bed.GetInherits().GetAllDirectInherits() == [Sdf.Path("/_class_/bed")]


def test_bindings_are_no_custom_properties(stage):
    bindings = [prim.GetRelationship("material:binding") for prim in stage.Traverse()]
    bindings = [binding for binding in bindings if binding]
    assert len(bindings) > 10
    assert not any(spec.custom for binding in bindings for spec in binding.GetPropertyStack())


def test_nothing_in_a_room_is_without_a_type(stage):
    root = stage.GetPseudoRoot()
    assert [str(prim.GetPath()) for prim in stage.Traverse() if not prim.GetTypeName()] == []
    assert {prim.GetName() for prim in root.GetFilteredChildren(Usd.PrimIsDefined & ~Usd.PrimIsAbstract)} == {"Room"}
    for name in ("Lights", "Cameras", "Looks"):
        assert stage.GetPrimAtPath(f"/Room/{name}").GetTypeName() == "Scope"


def test_every_layout_has_the_places_of_its_boxes(room, tmp_path):
    moved = Boxes(room.boxes.size, room.boxes.position + 0.1, room.boxes.yaw + 0.5)
    two = replace(room, layouts=(room.boxes, moved))
    stage = Usd.Stage.Open(str(two.save(tmp_path / "two", preview=False)))
    layouts = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    for number, word in enumerate(layouts.GetVariantNames()):
        layouts.SetVariantSelection(word)
        for row, name in enumerate(room.names):
            prim = UsdGeom.Xformable(stage.GetPrimAtPath(f"/Room/Objects/{name}"))
            found = np.array(prim.ComputeLocalToWorldTransform(0)).T
            np.testing.assert_allclose(found, two.pose(row, number), atol=1e-4)
    assert number == 1


def test_what_many_hosts_read_is_said_as_they_read_it(root):
    """Subsets that part the faces, guides that are not drawn, materials that are weaker than those below them."""
    stage = Usd.Stage.Open(str(root.parent / "assets/bed/bed.usda"))
    mesh = stage.GetPrimAtPath("/bed/geo/bed_mesh")
    for subset in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(mesh)):
        assert (subset.GetElementTypeAttr().Get(), subset.GetFamilyNameAttr().Get()) == ("face", "materialBind")
    assert UsdGeom.Subset.GetFamilyType(UsdGeom.Imageable(mesh), "materialBind") == "partition"
    assert UsdGeom.Subset.ValidateFamily(UsdGeom.Imageable(mesh), "face", "materialBind")[0]
    guides = [prim for prim in stage.Traverse() if prim.GetName().startswith("bed_collider")]
    assert {UsdGeom.Imageable(prim).ComputePurpose() for prim in guides} == {"guide"}
    contact = stage.GetPrimAtPath("/bed").GetRelationship("material:binding:physics")
    assert UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(contact) == "weakerThanDescendants"
    bed = stage.GetPrimAtPath("/bed")
    volume = sum(hull_volume(np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float)) for prim in guides)
    told = UsdPhysics.MaterialAPI(stage.GetPrimAtPath("/bed/mtl/contact"))
    assert told.GetDensityAttr().Get() * volume == pytest.approx(UsdPhysics.MassAPI(bed).GetMassAttr().Get(), rel=0.02)
    assert 0 <= told.GetRestitutionAttr().Get() < 0.2  # nothing in a home bounces


def test_colliders_end_where_the_meshes_do(room):
    for name, geometry in room.geometry.items():
        bounds = np.array([collider.mesh.bounds for collider in geometry.colliders])
        box = np.stack([bounds[:, 0].min(0), bounds[:, 1].max(0)])
        np.testing.assert_allclose(box, geometry.mesh.bounds, atol=2e-3, err_msg=name)


def test_a_palette_turns_images_plain_colours_and_gloss_alike_in_both_kinds_of_networks():
    slots = ("floor", "wood", "glass", "metal", "fabric", "wall")
    tables = {word: {slot: look(word, slot) for slot in slots} for word in ("oak", "ink")}
    assert all(tables["oak"][slot].gloss > tables["ink"][slot].gloss for slot in slots if slot != "glass")
    pen = Pen.blank("Room")
    for slot, one in tables["oak"].items():
        define_material(pen, f"/Room/Looks/{slot}", one, "oak")
    write_palettes(pen, "oak", tables)
    write_networks(pen, "oak", tables)
    assert not pen.layer.GetPrimAtPath("/Room{palette=ink}Looks/glass/surface")  # what all have alike is told once
    stage = Usd.Stage.Open(pen.layer)
    palettes = stage.GetPrimAtPath("/Room").GetVariantSet("palette")
    assert palettes.GetVariantSelection() == "oak"
    for word, looks in tables.items():
        palettes.SetVariantSelection(word)
        for slot, one in looks.items():
            at = f"/Room/Looks/{slot}"
            if one.pattern:
                factor = [b / a for a, b in zip(tables["oak"][slot].color, one.color, strict=True)]
                scale = stage.GetAttributeAtPath(f"{at}/image.inputs:scale").Get()
                assert list(scale) == pytest.approx([*factor, 1.0], abs=1e-3)
                tint = UsdShade.Shader.Get(stage, f"{at}/mtlx_tint").GetInput("in2").Get()
                assert list(tint) == pytest.approx(factor, abs=1e-3)
            else:
                for surface in ("surface", "mtlx_surface"):
                    color = UsdShade.Shader.Get(stage, f"{at}/{surface}").GetInput("diffuseColor").Get()
                    assert list(color) == pytest.approx(one.color, abs=1e-6)
            if slot in ("floor", "wood", "metal"):
                gloss = stage.GetAttributeAtPath(f"{at}/roughness.inputs:scale")
                assert list(gloss.Get() if gloss else (1, 1, 1, 1)) == pytest.approx([one.gloss] * 3 + [1.0])
                assert UsdShade.Shader.Get(stage, f"{at}/mtlx_gloss").GetInput("in2").Get() == pytest.approx(one.gloss)
            else:
                for surface in ("surface", "mtlx_surface"):
                    told = UsdShade.Shader.Get(stage, f"{at}/{surface}").GetInput("roughness").Get()
                    assert told == pytest.approx(one.rough)


def test_an_image_of_directions_is_told_between_minus_one_and_one_in_both_kinds_of_networks():
    pen, planks = Pen.blank("Room"), look("oak", "floor")
    define_material(pen, "/Room/Looks/floor", planks, "oak")
    write_networks(pen, "oak", {"oak": {"floor": planks}})
    stage = Usd.Stage.Open(pen.layer)
    image = UsdShade.Shader.Get(stage, "/Room/Looks/floor/normal")
    scale, bias = (np.array(image.GetInput(name).Get()) for name in ("scale", "bias"))
    assert (scale * 0.5 + bias)[:3].tolist() == [0, 0, 0]
    assert (scale * 1.0 + bias)[:3].tolist() == [1, 1, 1]
    steps = {name: UsdShade.Shader.Get(stage, f"/Room/Looks/floor/mtlx_{name}") for name in ("doubled", "centred")}
    by = {name: step.GetInput("in2").Get() for name, step in steps.items()}
    assert (steps["doubled"].GetIdAttr().Get(), by["doubled"]) == ("ND_multiply_vector3FA", 2.0)
    assert (steps["centred"].GetIdAttr().Get(), by["centred"]) == ("ND_subtract_vector3FA", 1.0)
    for name in ("image", "normal"):
        spaces = {"image": "sRGB", "normal": "raw"}
        assert (
            UsdShade.Shader.Get(stage, f"/Room/Looks/floor/{name}").GetInput("sourceColorSpace").Get() == spaces[name]
        )
        file = UsdShade.Shader.Get(stage, f"/Room/Looks/floor/mtlx_{name}").GetInput("file")
        assert file.Get().path.startswith("../textures/")
        assert (file.GetAttr().GetColorSpace() == "srgb_texture") == (name == "image")
    surface = UsdShade.Shader.Get(stage, "/Room/Looks/floor/surface")
    for name, channel in (("diffuseColor", "rgb"), ("normal", "rgb"), ("roughness", "r")):
        source, output, _ = surface.GetInput(name).GetConnectedSource()
        assert (source.GetPrim().GetName(), output) == ({"diffuseColor": "image"}.get(name, name), channel)


def test_provenance_in_every_layer_and_in_the_manifest(root, room, stage):
    for layer in stage.GetUsedLayers():
        if not layer.anonymous:
            data = layer.customLayerData
            assert data["generator"].startswith("echousd ")
            assert data["asset_license"] == "Apache-2.0"
            assert data["asset_name"]
    data = stage.GetRootLayer().customLayerData
    assert (data["seed"], data["model"]) == (3, "standin")
    manifest = json.loads((root.parent / "bedroom.json").read_text())
    assert manifest["seed"] == 3
    assert manifest["relations"] == {"kept": 4, "broken": 0, "unmeasured": 1}
    assert [v["state"] for v in manifest["verdicts"]] == [v.state for v in room.verdicts]
    assert manifest["meshes"]["bed"]["watertight"] is True


def test_z_up_room_is_turned_as_a_whole(room, tmp_path):
    turned = echousd.generate(
        small_graph(),
        seed=3,
        model=StandIn(),
        place=False,
        shapes="boxes",
        options=RoomOptions(up_axis="Z", walls=False, dress="none"),
    )
    stage = Usd.Stage.Open(str(turned.save(tmp_path / "bedroom", preview=False)))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    box = (
        UsdGeom.BBoxCache(0, ["default"])
        .ComputeWorldBound(stage.GetPrimAtPath("/Room/Objects/wardrobe"))
        .ComputeAlignedRange()
    )
    assert box.GetMax()[2] - box.GetMin()[2] == pytest.approx(2.2, abs=1e-3)
    place = (
        UsdGeom.Xformable(stage.GetPrimAtPath("/Room/Objects/lamp"))
        .ComputeLocalToWorldTransform(0)
        .ExtractTranslation()
    )
    np.testing.assert_allclose(place, (-1.25, 1.4, 0.5), atol=1e-4)
    gravity = UsdPhysics.Scene(stage.GetPrimAtPath("/Room/PhysicsScene")).GetGravityDirectionAttr().Get()
    assert gravity == Gf.Vec3f(0, 0, 0)  # down by the up axis of the stage that it is opened in
    assert read_graph(stage) == room.graph


def test_gravity_points_down_in_whatever_stage_refers_to_a_room(root):
    world = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(world, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(world, 1.0)
    room = UsdGeom.Xform.Define(world, "/World/Room")
    room.AddRotateXOp().Set(90)
    room.GetPrim().GetReferences().AddReference(str(root))
    assert world.GetPrimAtPath("/World/Room/PhysicsScene").IsA(UsdPhysics.Scene)
    assert list(gravity(Reading(world))) == []
    np.testing.assert_allclose(read_world(world).gravity, (0, 0, -9.81), atol=1e-3)


def test_walls_stand_around_the_floor(tmp_path):
    graph = small_graph(size=None, floor_polygon=((-2, -2), (2, -2), (2, 2), (0, 2), (0, 1), (-2, 1)), height=3.0)
    room = echousd.generate(
        graph, model=StandIn(), place=False, shapes="boxes", options=RoomOptions(walls=True, dress="none")
    )
    stage = Usd.Stage.Open(str(room.save(tmp_path / "bedroom", preview=False)))
    walls = [p for p in stage.GetPrimAtPath("/Room/Shell").GetChildren() if p.GetName().startswith("Wall_")]
    assert len(walls) == 6
    cache = UsdGeom.BBoxCache(0, ["default"])
    for wall in walls:
        box = cache.ComputeWorldBound(wall).ComputeAlignedRange()
        assert box.GetMax()[1] == pytest.approx(3.0)
        middle = (box.GetMin() + box.GetMax()) / 2
        outside = abs(middle[0]) > 2 or middle[2] < -2 or middle[2] > 2 or (middle[0] < 0 and middle[2] > 1)
        assert outside, wall.GetPath()


def test_a_floor_that_nobody_stated_lies_under_all_furniture():
    graph = small_graph(size=None)
    room = echousd.generate(graph, model=StandIn(), place=False, shapes="boxes", **BARE)
    corners = np.array(
        [room.pose(i) @ [x, 0, z, 1] for i, n in enumerate(room.names) for x, z in room.meshes[n].bounds[:, [0, 2]]]
    )
    assert (room.floor.min(0) <= corners[:, [0, 2]].min(0)).all()
    assert (room.floor.max(0) >= corners[:, [0, 2]].max(0)).all()


@pytest.fixture(scope="module")
def dressed():
    asked = {"walls": True, "dress": "some", "layouts": 2, "dress_graph": True}
    return echousd.generate(small_graph(), seed=3, drafts=1, faces=500, **asked)


def test_small_things_stand_and_are_told_where_they_were_put_in_every_layout(dressed, tmp_path):
    stage, found = Usd.Stage.Open(str(dressed.save(tmp_path / "bedroom", preview=False))), dress(dressed)
    chosen = stage.GetPrimAtPath("/Room").GetVariantSet("layout")
    assert len(found.layouts) == len(found.graphs) == len(chosen.GetVariantNames()) == 2
    for number, things in enumerate(found.layouts):
        chosen.SetVariantSelection(f"layout_{number}")
        prims = {prim.GetName(): prim for prim in stage.GetPrimAtPath("/Room/Dressing").GetChildren()}
        assert {*things} == {*prims}
        for name, thing in things.items():
            pose = np.array(UsdGeom.Xformable(prims[name]).GetLocalTransformation())
            np.testing.assert_allclose(pose[3, :3], thing.position, atol=1e-4)
            np.testing.assert_allclose(pose[2, :3], (np.sin(thing.yaw), 0, np.cos(thing.yaw)), atol=1e-5)
        told = read_dressing(stage)
        assert {node.name: node.category for node in told.nodes} == {
            n.name: n.category for n in found.graphs[number].nodes
        }
        assert {one.triple for one in told.relations} == {one.triple for one in found.graphs[number].relations}


def test_every_asset_has_the_joints_of_its_piece_and_others_none(dressed):
    files, moving = room_files(dressed), set()
    for name, user in dressed.asset_users.items():
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.ImportFromString(files[asset_file(name)].decode())
        kinds = [joint.kind for joint in dressed.geometry[user].joints]
        written = layer.ExportToString()
        assert written.count("def PhysicsPrismaticJoint") == kinds.count("prismatic")
        assert written.count("def PhysicsRevoluteJoint") == kinds.count("revolute")
        assert ("articulation" in written) == bool(kinds)
        moving |= {name} if kinds else set()
    assert 0 < len(moving) < len(dressed.asset_users)


def test_a_room_that_nobody_saves_is_told_as_from_the_present_folder(room, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    seen = []
    monkeypatch.setattr("echousd.layers.compose._asset", lambda *given: seen.append(given[-1]) or made(*given))
    for folder in (None, tmp_path / "there"):
        seen.clear()
        room_files(room, folder=folder)
        assert {*seen} == {(folder or tmp_path) / "assets" / name for name in room.asset_users}


@pytest.mark.parametrize("source", [None, "", "graphs/bedroom.yaml"])
def test_a_root_tells_what_it_was_made_from(room, source):
    told = simready_data(replace(room, provenance=replace(room.provenance, source=source)))
    assert told["source_file"] == told["SimReady_Metadata"]["source_file"] == (source or "none")


@pytest.mark.parametrize("asked", [{}, {"ceiling": True}, {"materialx": True}, {"ceiling": True, "materialx": True}])
def test_ceilings_and_networks_are_there_where_they_are_asked_for(tmp_path, asked):
    made = echousd.generate(
        small_graph(), seed=3, model=StandIn(), place=False, shapes="boxes", walls=True, dress="none", **asked
    )
    stage = Usd.Stage.Open(str(made.save(tmp_path / "bedroom", preview=False)))
    words = {word for prim in stage.Traverse() for word in labels(prim)}
    assert ("ceiling" in words) == ("ceiling" in asked)
    materials = [UsdShade.Material(prim) for prim in stage.Traverse() if prim.IsA(UsdShade.Material)]
    own = [one for one in materials if str(one.GetPath()).startswith("/Room/Looks")]
    assert own
    assert {bool(one.GetSurfaceOutput("mtlx").GetAttr()) for one in own} == {"materialx" in asked}
