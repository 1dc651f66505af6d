"""`layers/materials.usda`: the looks of the room, one per style and material group, and where they are bound.

MaterialX networks stand beside UsdPreviewSurface for hosts that prefer them (Storm, Karma, Arnold). Their surface is
MaterialX's own UsdPreviewSurface, so both networks of a material look alike; only nodes are used that MaterialX 1.38
and 1.39 both have.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pxr import Gf, Sdf, Usd, UsdGeom, UsdSemantics, UsdShade

from echousd.shapes.finishes import baking
from echousd.shapes.finishes.slots import material_of
from echousd.shapes.looks import Look
from echousd.stage.layouts import authored

LOOKS = "/Room/Looks"
IMAGES = {"diffuseColor": "image", "normal": "normal", "roughness": "roughness"}  # input -> its image's prim


def texture_files(looks: Mapping[str, Look], harmony: str) -> dict[str, bytes]:
    """Path in the room's folder -> image, for all patterns of some looks; equal ones are one file."""
    files: dict[str, bytes] = {}
    for look in looks.values():
        for path, content in look_images(look, harmony).values():
            files[path] = content
    return files


def look_images(look: Look, harmony: str) -> dict[str, tuple[str, bytes]]:
    """Input of a UsdPreviewSurface -> (path in the room's folder, image) of a look with a pattern; {} without one."""
    if not look.pattern:
        return {}
    tint = harmony if look.pattern.startswith("picture_") else baking.hexadecimal(look.color)
    found = {"diffuseColor": (f"{look.pattern}_{tint}", baking.color_image(look.pattern, look.color, harmony))}
    normal, rough = baking.normal_image(look.pattern, look.metres), baking.rough_image(look.pattern, look.roughness)
    if normal is not None:
        found["normal"] = (f"{look.pattern}_{look.metres * 100:.0f}cm_normal", normal)
    if rough is not None:
        found["roughness"] = (f"{look.pattern}_{look.roughness * 100:.0f}_roughness", rough)
    return {name: (f"textures/{path}.jpg", content) for name, (path, content) in found.items()}


def define_material(
    stage: Usd.Stage, path: str, look: Look, harmony: str = "", *, tinted: bool = False
) -> UsdShade.Material:
    """Author a UsdPreviewSurface material; a textured one reads `primvars:st`.

    `path`: where. `look`: what it looks like. `harmony`: whose colours its images have; "" = without images, for an
    asset that stands for itself. `tinted`: leave colours to `tint_material`, which a variant calls.
    """
    material = UsdShade.Material.Define(stage, path)
    word = material_of(path.rpartition("/")[2])
    UsdSemantics.LabelsAPI.Apply(material.GetPrim(), "material").CreateLabelsAttr([word])
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    images = look_images(look, harmony) if harmony else {}
    if images:
        reader = UsdShade.Shader.Define(stage, f"{path}/st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        coordinates = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        for name, (file, _) in images.items():
            _connect(stage, f"{path}/{IMAGES[name]}", file, shader, name, coordinates, look)
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    if not images and not tinted:
        color.Set(Gf.Vec3f(*look.color))
    if "roughness" not in images:
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(look.roughness)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(look.metallic)
    if look.opacity < 1:
        shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(look.opacity)
    if any(look.emissive):
        shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*look.emissive))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def _connect(
    stage: Usd.Stage, path: str, file: str, shader: UsdShade.Shader, name: str, st: UsdShade.Output, look: Look
) -> None:
    """An image that feeds one input of a surface."""
    kinds = {"diffuseColor": Sdf.ValueTypeNames.Color3f, "normal": Sdf.ValueTypeNames.Normal3f}
    image = UsdShade.Shader.Define(stage, path)
    image.CreateIdAttr("UsdUVTexture")
    image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(f"../{file}"))
    colored = name == "diffuseColor"
    image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB" if colored else "raw")
    fallback = {"diffuseColor": look.color, "normal": (0.5, 0.5, 1.0)}.get(name, (look.roughness,) * 3)
    image.CreateInput("fallback", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*fallback, 1.0))
    if name == "normal":
        image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(2, 2, 2, 1))
        image.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
    for axis in ("wrapS", "wrapT"):
        image.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
    image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(st)
    channel, kind = ("r", Sdf.ValueTypeNames.Float) if name == "roughness" else ("rgb", Sdf.ValueTypeNames.Float3)
    output = image.CreateOutput(channel, kind)
    shader.CreateInput(name, kinds.get(name, Sdf.ValueTypeNames.Float)).ConnectToSource(output)


def tint_factor(base: Look, look: Look) -> list[float]:
    """What the image of a material is multiplied with, to be in the colours of `look`; paintings have their own."""
    if base.pattern.startswith("picture_"):
        return [1.0, 1.0, 1.0]
    return [round(b / max(a, 1e-4), 4) for a, b in zip(base.color, look.color, strict=True)]


def tint_material(stage: Usd.Stage, path: str, base: Look, look: Look) -> None:
    """Author, for a variant, how a material comes from its images in the colours of `base` to those of `look`."""
    if base.pattern.startswith("picture_"):
        return
    if base.pattern:
        image = UsdShade.Shader(stage.OverridePrim(f"{path}/{IMAGES['diffuseColor']}"))
        image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*tint_factor(base, look), 1.0))
        return
    shader = UsdShade.Shader(stage.OverridePrim(f"{path}/surface"))
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*look.color))


def write_looks(
    stage: Usd.Stage, looks: Mapping[str, Look], bindings: Mapping[str, str], scope: str = LOOKS,
    also: Iterable[str] = (), harmony: str = "", tinted: bool = False,
) -> None:  # fmt: skip
    """Define every look that is bound, and bind it.

    `stage`: receives the opinions, as overs on whatever is bound. `looks`: material name -> look. `bindings`: prim path
    of a mesh or subset -> material name. `scope`: path of the prim that the materials stand below. `also`: names of
    looks that are defined, too, though another layer binds them. `harmony`, `tinted`: see `define_material`.
    """
    UsdGeom.Scope.Define(stage, scope)
    for name in sorted({*bindings.values(), *also}):
        define_material(stage, f"{scope}/{name}", looks[name], harmony, tinted=tinted)
    for path, name in bindings.items():
        prim = stage.OverridePrim(path)
        # `Bind` writes an uncustom relationship; three.js's parser loses a `custom rel`.
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material(stage.GetPrimAtPath(f"{scope}/{name}")))


def write_palettes(
    stage: Usd.Stage, chosen: str, looks: Mapping[str, Mapping[str, Look]], root: str = "/Room", scope: str = LOOKS
) -> None:
    """The variant set `palette` on a room or an asset: what each harmony makes of the materials.

    `stage`: of the materials' layer, whose materials are defined and have no colours yet. `chosen`: the harmony that
    the images are in. `looks`: harmony -> material name -> look. `root`: path of the prim that gets the set. `scope`:
    of the materials.
    """
    for harmony in authored(stage.GetPrimAtPath(root), "palette", looks, chosen):
        for name, look in sorted(looks[harmony].items()):  # bytes must not show the order of a set
            tint_material(stage, f"{scope}/{name}", looks[chosen][name], look)


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
