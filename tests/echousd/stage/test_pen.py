"""The pen authors what USD's own classes author, without a stage."""

import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdShade, Vt

from echomodel.openings import Opening
from echousd.stage import encoding
from echousd.stage.pen import Pen, ops
from echousd.stage.read import is_home
from echousd.stage.shading import Image, preview_surface


def test_what_the_pen_authors_is_what_usd_would():
    stage = Usd.Stage.Open(Sdf.Layer.CreateAnonymous(".usda"))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.GetRootLayer().defaultPrim = "a"
    stage.GetRootLayer().customLayerData = {"seed": 3}
    root = UsdGeom.Xform.Define(stage, "/a").GetPrim()
    Usd.ModelAPI(root).SetKind("component")
    UsdSemantics.LabelsAPI.Apply(root, "category").CreateLabelsAttr(["bed"])
    mesh = UsdGeom.Mesh.Define(stage, "/a/geo/mesh")
    mesh.AddTranslateOp(UsdGeom.XformOp.PrecisionFloat).Set(Gf.Vec3f(0, 1, 0))
    mesh.CreatePointsAttr(Vt.Vec3fArray([(0, 0, 0), (1, 2, 3)]))
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.GetPrim().CreateAttribute("mine", Sdf.ValueTypeNames.FloatArray).Set([1.0, 2.0])
    look = UsdShade.Material.Define(stage, "/a/look")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(look)
    for name, chosen in (("shown", "few"), ("light", None)):
        made = root.GetVariantSets().AddVariantSet(name)
        for word in ("all", "few"):
            made.AddVariant(word)
            made.SetVariantSelection(word)
            with made.GetVariantEditContext():
                UsdGeom.Imageable(stage.OverridePrim("/a/geo")).CreateVisibilityAttr("invisible")
        if chosen:
            made.SetVariantSelection(chosen)
        else:
            made.ClearVariantSelection()

    pen = Pen.blank("a", data={"seed": 3})
    pen.define("/a", "Xform", kind="component")
    pen.label("/a", category="bed")
    values = {"point3f[] points": [(0, 0, 0), (1, 2, 3)], "uniform token subdivisionScheme": "none"}
    values |= {**ops(translate=("float3", (0, 1, 0))), "custom float[] mine": [1.0, 2.0]}
    pen.define("/a/geo/mesh", "Mesh", values)
    pen.define("/a/look", "Material")
    pen.bind("/a/geo/mesh", "/a/look")
    for name, chosen in (("shown", "few"), ("light", None)):
        for inside in pen.variants("/a", name, ("all", "few"), chosen).values():
            inside.over("/a/geo", {"token visibility": "invisible"})
    assert pen.layer.ExportToString() == stage.GetRootLayer().ExportToString()


def test_a_material_of_images_is_a_network_that_usd_reads():
    pen = Pen.blank("a")
    image = Image("image", "wood.png", {"diffuseColor": "rgb", "opacity": "a"}, tint=(0.5, 1.0, 1.0))
    preview_surface(pen, "/a/wood", {"roughness": 0.5}, [image, Image("rough", "r.png", {"roughness": "g"})])
    stage = Usd.Stage.Open(pen.layer)
    surface = UsdShade.Material(stage.GetPrimAtPath("/a/wood")).ComputeSurfaceSource()[0]
    told = {each.GetBaseName(): each for each in surface.GetInputs()}
    assert told["diffuseColor"].GetTypeName() == Sdf.ValueTypeNames.Color3f
    source = UsdShade.Shader(told["opacity"].GetConnectedSources()[0][0].source)
    assert source.GetInput("file").Get().path == "wood.png"
    assert source.GetInput("scale").Get() == Gf.Vec4f(0.5, 1, 1, 1)
    assert source.GetInput("sourceColorSpace").Get() == "sRGB"
    rough = UsdShade.Shader(told["roughness"].GetConnectedSources()[0][0].source)
    assert rough.GetInput("sourceColorSpace").Get() == "raw"
    primvar = UsdShade.Shader(source.GetInput("st").GetConnectedSources()[0][0].source)
    assert primvar.GetInput("varname").Get() == "st"


def test_a_surface_reads_colours_directions_and_numbers_of_its_images_each_in_its_type():
    pen = Pen.blank("Looks")
    images = [
        Image("color", "c.jpg", {"diffuseColor": "rgb"}, tint=(0.5, 1.0, 1.0), fallback=(0.1, 0.2, 0.3)),
        Image("rough", "r.jpg", {"roughness": "r"}), Image("directions", "n.jpg", {"normal": "rgb"}),
    ]  # fmt: skip
    preview_surface(pen, "/Looks/wood", {"metallic": 0.0}, images)
    stage = Usd.Stage.Open(pen.layer)
    surface = UsdShade.Shader.Get(stage, "/Looks/wood/surface")
    kinds = {}
    for name in ("diffuseColor", "roughness", "normal"):
        source, output, _ = surface.GetInput(name).GetConnectedSource()
        kinds[name] = (output, str(source.GetOutput(output).GetTypeName()))
    assert kinds == {"diffuseColor": ("rgb", "float3"), "roughness": ("r", "float"), "normal": ("rgb", "float3")}
    color = UsdShade.Shader.Get(stage, "/Looks/wood/color")
    assert list(color.GetInput("scale").Get()) == [0.5, 1.0, 1.0, 1.0]
    assert list(color.GetInput("fallback").Get()) == pytest.approx([0.1, 0.2, 0.3, 1.0])
    assert UsdShade.Material.Get(stage, "/Looks/wood").ComputeSurfaceSource()[0].GetPath() == surface.GetPath()


def test_an_opening_says_what_is_not_usual_of_its_kind():
    window = Opening("w", "window", 0, 0.5, 1.0, 1.2, 0.9)
    assert {encoding.SILL} <= {*encoding.opening_values(window)}
    assert {encoding.HINGE, encoding.SWING}.isdisjoint(encoding.opening_values(window))
    low = encoding.opening_values(Opening("w", "window", 0, 0.5, 1.0, 2.2, 0.0))
    assert encoding.SILL not in low
    door = encoding.opening_values(Opening("d", "door", 0, 0.5, 0.9, 2.0, hinge="right", swing="out"))
    assert (door[encoding.HINGE], door[encoding.SWING]) == ("right", "out")
    assert {encoding.HINGE, encoding.SWING} <= {*encoding.opening_values(Opening("d", "door", 0, 0.5, 0.9, 2.0))}


@pytest.mark.parametrize(
    ("types", "home"),
    [((), False), (("EchoSceneGraph",), False), (("EchoSceneGraph",) * 2, True), ((encoding.HOME_TYPE,), True)],
)
def test_a_home_is_a_stage_of_several_rooms_or_one_that_says_so(types, home):
    stage = Usd.Stage.CreateInMemory()
    for number, kind in enumerate(types):
        stage.DefinePrim(f"/Room_{number}/Graph", kind)
    assert is_home(stage) is home
