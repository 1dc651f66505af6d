"""`layers/materials.usda`: the looks of the room, one per style and material group, and where they are bound."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from echousd.room.looks import Look

LOOKS = "/Room/Looks"


def define_material(stage: Usd.Stage, path: str, look: Look) -> UsdShade.Material:
    """Author a UsdPreviewSurface material; a textured one reads `primvars:st`."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    if look.texture:
        reader = UsdShade.Shader.Define(stage, f"{path}/st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        image = UsdShade.Shader.Define(stage, f"{path}/image")
        image.CreateIdAttr("UsdUVTexture")
        image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(look.texture))
        image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
        image.CreateInput("fallback", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*look.color, 1.0))
        for axis in ("wrapS", "wrapT"):
            image.CreateInput(axis, Sdf.ValueTypeNames.Token).Set("repeat")
        image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(
            reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        )
        color.ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    else:
        color.Set(Gf.Vec3f(*look.color))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(look.roughness)
    shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(look.metallic)
    if look.opacity < 1:
        shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(look.opacity)
    if any(look.emissive):
        shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*look.emissive))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def write_looks(
    stage: Usd.Stage,
    looks: Mapping[str, Look],
    bindings: Mapping[str, str],
    scope: str = LOOKS,
    also: Iterable[str] = (),
) -> None:
    """Define every look that is bound, and bind it.

    Arguments:
        stage: receives the opinions, as overs on whatever is bound.
        looks: material name -> look.
        bindings: prim path of a mesh or subset -> material name.
        scope: path of the prim that the materials stand below.
        also: names of looks that are defined, too, though another layer binds them.
    """
    UsdGeom.Scope.Define(stage, scope)
    for name in sorted({*bindings.values(), *also}):
        define_material(stage, f"{scope}/{name}", looks[name])
    for path, name in bindings.items():
        prim = stage.OverridePrim(path)
        # `Bind` writes an uncustom relationship; three.js's parser loses a `custom rel`.
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material(stage.GetPrimAtPath(f"{scope}/{name}")))


def planks(color: Sequence[float], *, seed: int = 0, size: int = 512, rows: int = 8) -> bytes:
    """A tileable picture of floor boards as PNG bytes, the same for the same arguments.

    Arguments:
        color: linear RGB of the wood.
        seed: of the pattern.
        size: pixels on each side; the picture is meant for about 1.6 m of floor.
        rows: boards across.
    """
    from PIL import Image

    rng = np.random.default_rng(seed)
    board = size // rows
    tone = np.ones((size, size, 1))
    for row in range(rows):
        start = int(rng.integers(size))
        ends = [start, start + size // 2 + int(rng.integers(-size // 12, size // 12))]
        base = rng.normal(1.0, 0.055, 2)
        x = (np.arange(size) - start) % size
        band = np.where(x < ends[1] - ends[0], base[0], base[1])[None, :]
        grain = _waves(rng, board, size, 0.028)
        tone[row * board : (row + 1) * board, :, 0] = band + grain
        tone[row * board, :, 0] *= 0.72  # the joint between two rows
        for end in ends:
            tone[row * board : (row + 1) * board, end % size, 0] *= 0.72
    value = np.clip(np.asarray(color) * tone, 0, 1)
    srgb = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    out = io.BytesIO()
    Image.fromarray((srgb * 255 + 0.5).astype(np.uint8)).save(out, "PNG", optimize=False)
    return out.getvalue()


def _waves(rng: np.random.Generator, height: int, width: int, strength: float) -> np.ndarray:
    """Fibres along x, periodic in x."""
    x = np.arange(width) / width
    fibres = np.zeros((height, width))
    for octave in (1, 2, 5):
        phase = rng.random(height)[:, None]
        smooth = np.convolve(rng.normal(size=height + 4), np.ones(5) / 5, "valid")[:, None]
        fibres += smooth * (1 + 0.5 * np.sin(2 * np.pi * (octave * x[None] + phase)))
    return strength * fibres
