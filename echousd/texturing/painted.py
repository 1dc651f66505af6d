"""A painted look as files of a room: `looks/<name>.usda`, its texture coordinates, and its pictures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, Vt

import echousd
from echousd.draw.surfaces import Painted, Surfaces
from echousd.layers.paintings import FOLDER, MADE, RECORD, VARIANTS, primvar
from echousd.stage.files import layer_bytes
from echousd.stage.units import set_units
from echousd.texturing.results import Result, Results

ROUGHNESS = 0.75


def look_files(
    stage: Usd.Stage, surfaces: Surfaces, results: Results, name: str, tool: str, dressing: str
) -> dict[str, bytes]:
    """Path in the room's folder -> content.

    Arguments:
        stage: the room, whose units the layers take. surfaces: what it holds. results: what was painted.
        name: of the look. tool: who painted it. dressing: see `read_surfaces`.
    """
    painted = [thing for thing in surfaces.objects if thing.name in results.objects]
    look, laid = _stage(stage, surfaces), _stage(stage, surfaces)
    for layer in (look, laid):
        variants = layer.GetPrimAtPath(surfaces.room).GetVariantSets().AddVariantSet(VARIANTS)
        for word in (MADE, name):
            variants.AddVariant(word)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            for thing in painted:
                result = results.objects[thing.name]
                if layer is look:
                    _bind(layer, surfaces.room, thing, result, name)
                else:
                    _lay_out(layer, thing, result, name)
    laid.GetPrimAtPath(surfaces.room).GetVariantSets().GetVariantSet(VARIANTS).ClearVariantSelection()
    for path in dict.fromkeys(path for thing in painted for piece in thing.pieces for path in piece.instances):
        look.OverridePrim(path).SetInstanceable(False)  # each gets a picture of its own
    top = look.GetRootLayer()
    top.documentation = "Painted by a texturing tool. Yours: no generation touches it."
    top.customLayerData = {
        "generator": f"echousd {echousd.__version__}",
        RECORD: {
            "name": name,
            "tool": tool,
            "dressing": dressing,
            "objects": {thing.path: thing.topology for thing in painted},
            "meshes": Vt.StringArray([piece.path for thing in painted for piece in thing.pieces]),
        },
    }
    own = Sdf.Layer.CreateAnonymous(".usda")
    own.TransferContent(top)
    own.subLayerPaths = [f"./{name}/st.usdc"]
    files = {f"{FOLDER}/{name}/{picture}": content for picture, content in sorted(results.pictures.items())}
    files[f"{FOLDER}/{name}/st.usdc"] = layer_bytes(laid.GetRootLayer(), ".usdc")
    files[f"{FOLDER}/{name}.usda"] = layer_bytes(own, ".usda")
    return files


def _stage(room: Usd.Stage, surfaces: Surfaces) -> Usd.Stage:
    stage = Usd.Stage.Open(Sdf.Layer.CreateAnonymous(".usda"))
    set_units(stage.GetRootLayer(), room)
    stage.GetRootLayer().defaultPrim = surfaces.room.split("/")[1]
    stage.OverridePrim(surfaces.room)
    return stage


def _bind(stage: Usd.Stage, room: str, thing: Painted, result: Result, name: str) -> None:
    """One material for the object, over whatever its meshes and subsets are bound to."""
    material = _material(stage, f"{room}/Looks/{name}_{thing.name}", result.images, name)
    owner = stage.OverridePrim(thing.path)
    chosen = Usd.CollectionAPI.Apply(owner, name)
    chosen.CreateExpansionRuleAttr(Usd.Tokens.expandPrims)
    kept = [path for piece in thing.pieces for path in piece.kept]
    chosen.CreateIncludesRel().SetTargets([Sdf.Path(p.path) for p in thing.pieces if p.path not in kept])
    inner = [Sdf.Path(path) for piece in thing.pieces for path in piece.kept if path != piece.path]
    if inner:
        chosen.CreateExcludesRel().SetTargets(inner)
    UsdShade.MaterialBindingAPI.Apply(owner).Bind(chosen, material, name, UsdShade.Tokens.strongerThanDescendants)


def _material(stage: Usd.Stage, path: str, images: Mapping[str, str], name: str) -> UsdShade.Material:
    UsdGeom.Scope.Define(stage, path.rpartition("/")[0])
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    reader = UsdShade.Shader.Define(stage, f"{path}/st")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set(primvar(name))
    st = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    color, number = Sdf.ValueTypeNames.Color3f, Sdf.ValueTypeNames.Float
    image = _image(stage, f"{path}/color", f"./{name}/{images['color']}", st, "sRGB")
    shader.CreateInput("diffuseColor", color).ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    if "metal_rough" in images:
        image = _image(stage, f"{path}/metal_rough", f"./{name}/{images['metal_rough']}", st, "raw")
        shader.CreateInput("roughness", number).ConnectToSource(image.CreateOutput("g", number))
        shader.CreateInput("metallic", number).ConnectToSource(image.CreateOutput("b", number))
    else:
        shader.CreateInput("roughness", number).Set(ROUGHNESS)
        shader.CreateInput("metallic", number).Set(0.0)
    if "normal" in images:
        image = _image(stage, f"{path}/normal", f"./{name}/{images['normal']}", st, "raw")
        image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(2, 2, 2, 1))
        image.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
        normal = shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f)
        normal.ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def _image(stage: Usd.Stage, path: str, file: str, st: UsdShade.Output, space: str) -> UsdShade.Shader:
    image = UsdShade.Shader.Define(stage, path)
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(file))
    image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
    for axis in ("wrapS", "wrapT"):
        image.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("clamp")
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
    return image


def _lay_out(stage: Usd.Stage, thing: Painted, result: Result, name: str) -> None:
    """The primvar of the look on every mesh of an object."""
    start = 0
    for piece in thing.pieces:
        own = result.st[start : start + len(piece.corners)]
        start += len(piece.corners)
        corner = np.zeros((piece.size, 2), np.float32)
        corner[piece.corners.reshape(-1)] = own.reshape(-1, 2)
        values, index = np.unique(corner, axis=0, return_inverse=True)
        primvars = UsdGeom.PrimvarsAPI(stage.OverridePrim(piece.path))
        made = primvars.CreatePrimvar(primvar(name), Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
        made.Set(Vt.Vec2fArray.FromNumpy(values))
        made.SetIndices(Vt.IntArray.FromNumpy(index.reshape(-1).astype(np.int32)))
