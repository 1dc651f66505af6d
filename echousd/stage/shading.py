"""Materials as UsdPreviewSurface, with images or without."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from echousd.stage.pen import Pen, say

KINDS = {"diffuseColor": "color3f", "emissiveColor": "color3f", "normal": "normal3f"}  # every other input is a float


class Image(NamedTuple):
    """An image that feeds inputs of a surface."""

    name: str  # of its prim
    file: str  # as the layer names it
    inputs: Mapping[str, str]  # input -> channel
    tint: Sequence[float] = ()  # what its colours are multiplied with
    fallback: Sequence[float] = ()  # its colour where there is no file


def preview_surface(
    pen: Pen, path: str, values: Mapping[str, Any], images: Sequence[Image] = (), st: str = "st", wrap: str = "repeat"
) -> None:
    """Define a material.

    `path`: where. `values`: input of the surface -> value, None = a variant says it. `images`: what feeds the others.
    `st`: primvar by which the images are laid. `wrap`: what is beyond their edges.
    """
    pen.define(path, "Material", {"token outputs:surface.connect": f"{path}/surface.outputs:surface"})
    surface = pen.define(f"{path}/surface", "Shader", {"uniform token info:id": "UsdPreviewSurface"})
    if images:
        reader = {"uniform token info:id": "UsdPrimvarReader_float2", "string inputs:varname": st}
        pen.define(f"{path}/st", "Shader", {**reader, "float2 outputs:result": None})
    for image in images:
        colored = KINDS.get(next(iter(image.inputs))) == "color3f"
        fields: dict[str, Any] = {
            "uniform token info:id": "UsdUVTexture", "asset inputs:file": image.file,
            "token inputs:sourceColorSpace": "sRGB" if colored else "raw", "token inputs:wrapS": wrap,
            "token inputs:wrapT": wrap, "float2 inputs:st.connect": f"{path}/st.outputs:result",
        }  # fmt: skip
        if image.fallback:
            fields["float4 inputs:fallback"] = (*image.fallback, 1.0)
        if image.tint and tuple(image.tint) != (1.0, 1.0, 1.0):
            fields["float4 inputs:scale"] = (*image.tint, 1.0)
        if "normal" in image.inputs:
            fields |= {"float4 inputs:scale": (2, 2, 2, 1), "float4 inputs:bias": (-1, -1, -1, 0)}
        for name, channel in image.inputs.items():
            fields[f"{'float3' if channel == 'rgb' else 'float'} outputs:{channel}"] = None
            say(surface, {f"{_words(name)}.connect": f"{path}/{image.name}.outputs:{channel}"})
        pen.define(f"{path}/{image.name}", "Shader", fields)
    say(surface, {**{_words(name): value for name, value in values.items()}, "token outputs:surface": None})


def _words(name: str) -> str:
    return f"{KINDS.get(name, 'float')} inputs:{name}"
