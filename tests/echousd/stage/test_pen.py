"""The pen authors what USD's own classes author, without a stage."""

from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdShade, Vt

from echousd.stage.pen import Pen, ops
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
