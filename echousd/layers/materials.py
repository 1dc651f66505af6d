"""`layers/materials.usda`: the looks of the room, one per style and material group, and where they are bound."""

from collections.abc import Iterable, Mapping
from typing import Any
from zlib import crc32

from echomodel.dressing import PRINTS
from echousd.shapes.finishes import baking
from echousd.shapes.finishes.slots import material_of
from echousd.shapes.looks import Look
from echousd.stage.pen import Pen
from echousd.stage.shading import Image, preview_surface

LOOKS = "/Room/Looks"
IMAGES = {"diffuseColor": "image", "normal": "normal", "roughness": "roughness"}  # input -> its image's prim


def look_images(look: Look, harmony: str) -> dict[str, tuple[str, bytes]]:
    """Input of a UsdPreviewSurface -> (path in the room's folder, image) of a look with a pattern; {} without one."""
    if not look.pattern:
        return {}
    printed = look.pattern in PRINTS  # of which many are alike in several harmonies, and lie on the same cloth
    worn, cloth = (0.0, look.pattern.partition("_")[0]) if printed else (look.worn, look.pattern)
    image = baking.color_image(look.pattern, look.color, harmony, worn)
    tint = f"{crc32(image):08x}" if printed else baking.hexadecimal(look.color)
    found = {"diffuseColor": (f"{look.pattern}_{tint}" + f"_worn{1000 * worn:.0f}" * (worn > 0), image)}
    normal, rough = baking.normal_image(look.pattern, look.metres), baking.rough_image(look.pattern, look.roughness)
    if normal is not None:
        found["normal"] = (f"{cloth}_{look.metres * 100:.0f}cm_normal", normal)
    if rough is not None:
        found["roughness"] = (f"{look.pattern}_{look.roughness * 100:.0f}_roughness", rough)
    return {name: (f"textures/{path}.jpg", content) for name, (path, content) in found.items()}


def define_material(pen: Pen, path: str, look: Look, harmony: str = "") -> None:
    """Author a UsdPreviewSurface material; a textured one reads `primvars:st`. `tints` tell colour and gloss.

    `path`: where. `look`: what it looks like. `harmony`: whose colours its images have; "" = without images, for an
    asset that stands for itself.
    """
    found = look_images(look, harmony) if harmony else {}
    fallbacks = {"diffuseColor": look.color, "normal": (0.5, 0.5, 1.0), "roughness": (look.roughness,) * 3}
    images = [
        Image(IMAGES[name], f"../{file}", {name: "r" if name == "roughness" else "rgb"}, fallback=fallbacks[name])
        for name, (file, _) in found.items()
    ]
    values: dict[str, Any] = {name: None for name in ("diffuseColor", "roughness") if name not in found}
    values["metallic"] = look.metallic
    if look.opacity < 1:
        values["opacity"] = look.opacity
    if any(look.emissive):
        values["emissiveColor"] = look.emissive
    preview_surface(pen, path, values, images)
    pen.label(path, material=material_of(path.rpartition("/")[2]))


def uneven(look: Look) -> bool:
    """Whether an image says how rough a look is, place by place."""
    return bool(look.pattern) and baking.rough_image(look.pattern, look.roughness) is not None


def tint_factor(base: Look, look: Look) -> list[float]:
    """What the image of a material is multiplied with, to be in the colours of `look`; paintings have their own."""
    if base.pattern.startswith("picture_"):
        return [1.0, 1.0, 1.0]
    return [round(b / max(a, 1e-4), 4) for a, b in zip(base.color, look.color, strict=True)]


def tints(base: Look, look: Look) -> dict[tuple[str, str], Any]:
    """Part of a material and its property -> what makes of images in the colours of `base` those of `look`, and its
    gloss.
    """
    found: dict[tuple[str, str], Any] = {}
    if not base.pattern:
        found["surface", "color3f inputs:diffuseColor"] = look.color
    elif not base.pattern.startswith("picture_"):
        found[IMAGES["diffuseColor"], "float4 inputs:scale"] = (*tint_factor(base, look), 1.0)
    if not uneven(base):
        found["surface", "float inputs:roughness"] = look.rough
    else:
        found[IMAGES["roughness"], "float4 inputs:scale"] = (*(look.gloss,) * 3, 1.0)
    return found


def write_looks(
    pen: Pen, looks: Mapping[str, Look], bindings: Mapping[str, str], scope: str = LOOKS, also: Iterable[str] = (),
    harmony: str = "",
) -> None:  # fmt: skip
    """Define every look that is bound, and bind it.

    `pen`: writes the opinions, as overs on whatever is bound. `looks`: material name -> look. `bindings`: prim path of
    a mesh or subset -> material name. `scope`: path of the prim that the materials stand below. `also`: names of looks
    that are defined, too, though another layer binds them. `harmony`: see `define_material`.
    """
    pen.define(scope, "Scope")
    for name in sorted({*bindings.values(), *also}):
        define_material(pen, f"{scope}/{name}", looks[name], harmony)
    for path, name in bindings.items():
        pen.bind(path, f"{scope}/{name}")


def write_palettes(
    pen: Pen, chosen: str, looks: Mapping[str, Mapping[str, Look]], root: str = "/Room", scope: str = LOOKS
) -> None:
    """The variant set `palette` on a room or an asset: what each harmony makes of the materials.

    `pen`: of the materials' layer, whose materials are defined and have no colours yet. `chosen`: the harmony that the
    images are in. `looks`: harmony -> material name -> look. `root`: path of the prim that gets the set. `scope`: of
    the materials.
    """
    pens = pen.variants(root, "palette", looks, chosen)
    for name, base in sorted(looks[chosen].items()):  # bytes must not show the order of a set
        every = {harmony: tints(base, looks[harmony][name]) for harmony in pens}
        for (part, words), value in every[chosen].items():
            alike = all(told[part, words] == value for told in every.values())
            for harmony, inside in {chosen: pen}.items() if alike else pens.items():  # once, beside the variants
                inside.over(f"{scope}/{name}/{part}", {words: every[harmony][part, words]})
