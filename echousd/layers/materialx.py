"""MaterialX networks beside UsdPreviewSurface, for hosts that prefer them (Storm, Karma, Arnold).

Their surface is MaterialX's own UsdPreviewSurface, so both networks of a material look alike; only nodes are used that
MaterialX 1.38 and 1.39 both have.
"""

from collections.abc import Mapping
from typing import Any

from echousd.layers.materials import LOOKS, look_images, tint_factor, uneven
from echousd.shapes.looks import Look
from echousd.stage.pen import Pen

CONTEXT = "mtlx"  # the render context of the outputs


def write_networks(pen: Pen, chosen: str, looks: Mapping[str, Mapping[str, Look]]) -> None:
    """Add a MaterialX network to every material of the room, and its colours to the variant set `palette`.

    `pen`: of the materials' layer, whose materials and palettes are written. `chosen`: the harmony that the images are
    in. `looks`: harmony -> material name -> look.
    """
    for name, look in sorted(looks[chosen].items()):
        _network(pen, f"{LOOKS}/{name}", look, chosen)
    for harmony, inside in pen.variants("/Room", "palette", looks, chosen).items():
        for name, look in sorted(looks[harmony].items()):
            _tint(inside, f"{LOOKS}/{name}", looks[chosen][name], look)


def _network(pen: Pen, path: str, look: Look, harmony: str) -> None:
    """One material's network; its colour comes with the palette."""
    images = {name: file for name, (file, _) in look_images(look, harmony).items()}
    values: dict[str, Any] = {
        "float inputs:metallic": look.metallic, "float inputs:opacity": look.opacity,
        "color3f inputs:emissiveColor": look.emissive, "color3f inputs:diffuseColor": None,
        "float inputs:roughness": None,
    }  # fmt: skip
    surface = _node(pen, f"{path}/mtlx_surface", "ND_UsdPreviewSurface_surfaceshader", "token", values)
    feeds: dict[str, str] = {}
    if images:
        at = _node(pen, f"{path}/mtlx_st", "ND_geompropvalue_vector2", "float2", {"string inputs:geomprop": "st"})
    if "diffuseColor" in images:
        image = _image(pen, f"{path}/mtlx_image", "ND_image_color3", "color3f", images["diffuseColor"], at)
        tint = {"color3f inputs:in1.connect": image}
        feeds["color3f inputs:diffuseColor"] = _node(pen, f"{path}/mtlx_tint", "ND_multiply_color3", "color3f", tint)
    if "roughness" in images:
        rough = _image(pen, f"{path}/mtlx_roughness", "ND_image_float", "float", images["roughness"], at)
        gloss = {"float inputs:in1.connect": rough}
        feeds["float inputs:roughness"] = _node(pen, f"{path}/mtlx_gloss", "ND_multiply_float", "float", gloss)
    if "normal" in images:
        value = _image(pen, f"{path}/mtlx_normal", "ND_image_vector3", "float3", images["normal"], at)
        for step, kind, number in (("doubled", "multiply", 2.0), ("centred", "subtract", 1.0)):  # 0 .. 1 -> -1 .. 1
            inputs = {"float3 inputs:in1.connect": value, "float inputs:in2": number}
            value = _node(pen, f"{path}/mtlx_{step}", f"ND_{kind}_vector3FA", "float3", inputs)
        feeds["float3 inputs:normal"] = value
    pen.over(f"{path}/mtlx_surface", {f"{words}.connect": output for words, output in feeds.items()})
    pen.over(path, {f"token outputs:{CONTEXT}:surface.connect": surface})


def _tint(pen: Pen, path: str, base: Look, look: Look) -> None:
    """What a harmony makes of a material: factors of its images, or a plain colour and roughness."""
    plain: dict[str, Any] = {} if base.pattern else {"color3f inputs:diffuseColor": look.color}
    if base.pattern:
        pen.over(f"{path}/mtlx_tint", {"color3f inputs:in2": tuple(tint_factor(base, look))})
    if uneven(base):
        pen.over(f"{path}/mtlx_gloss", {"float inputs:in2": look.gloss})
    else:
        plain["float inputs:roughness"] = look.rough
    if plain:
        pen.over(f"{path}/mtlx_surface", plain)


def _node(pen: Pen, path: str, identifier: str, kind: str, values: Mapping[str, Any]) -> str:
    """A node of a network; returns the path of its output, which is of a kind."""
    pen.define(path, "Shader", {"uniform token info:id": identifier, **values, f"{kind} outputs:out": None})
    return f"{path}.outputs:out"


def _image(pen: Pen, path: str, identifier: str, kind: str, file: str, st: str) -> str:
    """A picture that repeats; `file` is its path in the room's folder. Returns the path of its output."""
    output = _node(
        pen, path, identifier, kind, {"asset inputs:file": f"../{file}", "float2 inputs:texcoord.connect": st}
    )
    if kind == "color3f":
        pen.over(path).attributes["inputs:file"].SetInfo("colorSpace", "srgb_texture")
    return output
