"""MaterialX beside UsdPreviewSurface: the same looks as networks for hosts that prefer them (Storm, Karma, Arnold).

The surface is MaterialX's own UsdPreviewSurface, so both networks of a material look alike; only nodes are used that
MaterialX 1.38 and 1.39 both have.
"""

from __future__ import annotations

from collections.abc import Mapping

from pxr import Gf, Sdf, Usd, UsdShade

from echousd.layers.materials import LOOKS, look_images, tint_factor
from echousd.shapes.looks import Look
from echousd.stage.layouts import authored

CONTEXT = "mtlx"  # the render context of the outputs
SURFACE = "ND_UsdPreviewSurface_surfaceshader"
Types = Sdf.ValueTypeNames


def write_networks(stage: Usd.Stage, chosen: str, looks: Mapping[str, Mapping[str, Look]]) -> None:
    """Add a MaterialX network to every material of the room, and its colours to the variant set `palette`.

    `stage`: of the materials' layer, whose materials and palettes are written. `chosen`: the harmony that the images
    are in. `looks`: harmony -> material name -> look.
    """
    for name, look in sorted(looks[chosen].items()):
        _network(stage, f"{LOOKS}/{name}", look, chosen)
    for harmony in authored(stage.GetPrimAtPath("/Room"), "palette", looks, chosen):
        for name, look in sorted(looks[harmony].items()):
            _tint(stage, f"{LOOKS}/{name}", looks[chosen][name], look)


def _network(stage: Usd.Stage, path: str, look: Look, harmony: str) -> None:
    """One material's network; its colour comes with the palette."""
    surface = _node(stage, f"{path}/mtlx_surface", SURFACE)
    surface.CreateInput("metallic", Types.Float).Set(look.metallic)
    surface.CreateInput("opacity", Types.Float).Set(look.opacity)
    surface.CreateInput("emissiveColor", Types.Color3f).Set(Gf.Vec3f(*look.emissive))
    color, rough = surface.CreateInput("diffuseColor", Types.Color3f), surface.CreateInput("roughness", Types.Float)
    images = look_images(look, harmony)
    if images:
        st = _node(stage, f"{path}/mtlx_st", "ND_geompropvalue_vector2")
        st.CreateInput("geomprop", Types.String).Set("st")
        at = st.CreateOutput("out", Types.Float2)
    if "diffuseColor" in images:
        image = _image(stage, f"{path}/mtlx_image", "ND_image_color3", Types.Color3f, images["diffuseColor"][0], at)
        tint = _node(stage, f"{path}/mtlx_tint", "ND_multiply_color3")
        tint.CreateInput("in1", Types.Color3f).ConnectToSource(image)
        color.ConnectToSource(tint.CreateOutput("out", Types.Color3f))
    if "roughness" in images:
        file = images["roughness"][0]
        rough.ConnectToSource(_image(stage, f"{path}/mtlx_roughness", "ND_image_float", Types.Float, file, at))
    else:
        rough.Set(look.roughness)
    if "normal" in images:
        value = _image(stage, f"{path}/mtlx_normal", "ND_image_vector3", Types.Float3, images["normal"][0], at)
        for step, kind, number in (("doubled", "multiply", 2.0), ("centred", "subtract", 1.0)):  # 0 .. 1 -> -1 .. 1
            node = _node(stage, f"{path}/mtlx_{step}", f"ND_{kind}_vector3FA")
            node.CreateInput("in1", Types.Float3).ConnectToSource(value)
            node.CreateInput("in2", Types.Float).Set(number)
            value = node.CreateOutput("out", Types.Float3)
        surface.CreateInput("normal", Types.Float3).ConnectToSource(value)
    material = UsdShade.Material(stage.GetPrimAtPath(path))
    material.CreateSurfaceOutput(CONTEXT).ConnectToSource(surface.CreateOutput("out", Types.Token))


def _tint(stage: Usd.Stage, path: str, base: Look, look: Look) -> None:
    """What a harmony makes of a material: the factor of its image, or its plain colour."""
    if base.pattern:
        node, name, value = "mtlx_tint", "in2", Gf.Vec3f(*tint_factor(base, look))
    else:
        node, name, value = "mtlx_surface", "diffuseColor", Gf.Vec3f(*look.color)
    UsdShade.Shader(stage.OverridePrim(f"{path}/{node}")).CreateInput(name, Types.Color3f).Set(value)


def _node(stage: Usd.Stage, path: str, identifier: str) -> UsdShade.Shader:
    node = UsdShade.Shader.Define(stage, path)
    node.CreateIdAttr(identifier)
    return node


def _image(
    stage: Usd.Stage, path: str, identifier: str, kind: Sdf.ValueTypeName, file: str, st: UsdShade.Output
) -> UsdShade.Output:
    """A picture that repeats; `file` is its path in the room's folder."""
    node = _node(stage, path, identifier)
    asset = node.CreateInput("file", Types.Asset)
    asset.Set(Sdf.AssetPath(f"../{file}"))
    if kind == Types.Color3f:
        asset.GetAttr().SetColorSpace("srgb_texture")
    node.CreateInput("texcoord", Types.Float2).ConnectToSource(st)
    return node.CreateOutput("out", kind)
