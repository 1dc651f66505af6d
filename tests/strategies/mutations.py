"""One wrong value in a finished room: every attribute that it has, with values of every type."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, Vt

TYPES = Sdf.ValueTypeNames
VALUES: dict[str, tuple[Any, Any]] = {
    "nan": (TYPES.Float, math.nan),
    "infinity": (TYPES.Double, math.inf),
    "huge": (TYPES.Double, 1e30),
    "negative": (TYPES.Int, -1),
    "largest int": (TYPES.Int, 2**31 - 1),
    "zero": (TYPES.Float, 0.0),
    "text": (TYPES.String, "²:SDF_FORMAT_ARGS:a=b\\\t\n[red]\x1b[31m"),
    "empty text": (TYPES.String, ""),
    "long text": (TYPES.Token, "x" * 5000),
    "texts": (TYPES.StringArray, Vt.StringArray(["a", "b"])),
    "tokens": (TYPES.TokenArray, Vt.TokenArray(["xformOp:gone", "!resetXformStack!", "!invert!xformOp:translate"])),
    "no tokens": (TYPES.TokenArray, Vt.TokenArray()),
    "asset": (TYPES.Asset, Sdf.AssetPath("./nowhere.png")),
    "assets": (TYPES.AssetArray, Sdf.AssetPathArray([Sdf.AssetPath("./nowhere.png")])),
    "truth": (TYPES.Bool, True),
    "vector": (TYPES.Double3, Gf.Vec3d(math.nan, 1e30, -1)),
    "pair": (TYPES.Float2, Gf.Vec2f(-1, 3)),
    "matrix": (TYPES.Matrix4d, Gf.Matrix4d(0)),
    "points of NaN": (TYPES.Point3fArray, Vt.Vec3fArray([Gf.Vec3f(math.nan)] * 8)),
    "huge points": (TYPES.Point3fArray, Vt.Vec3fArray([Gf.Vec3f(1e30)] * 8)),
    "no points": (TYPES.Point3fArray, Vt.Vec3fArray()),
    "pairs": (TYPES.TexCoord2fArray, Vt.Vec2fArray([Gf.Vec2f(math.inf, 0)])),
    "negative ints": (TYPES.IntArray, Vt.IntArray([-5, 3, 2**31 - 1])),
    "floats": (TYPES.FloatArray, Vt.FloatArray([math.nan, 1.0])),
    "blocked": (TYPES.Float, Sdf.ValueBlock()),
}
SHAPES = ("value", "sample", "connection", "relationship")


@dataclass(frozen=True)
class Mutation:
    """A value of `VALUES` at a property, authored as `SHAPES` says."""

    path: str
    value: str
    shape: str = "value"


def properties(stage: Usd.Stage) -> list[str]:
    """Property paths of a stage, one of each name on each type of prim, those without an opinion included."""
    chosen: dict[tuple[str, str, str], str] = {}
    for prim in stage.TraverseAll():
        for name in prim.GetPropertyNames():
            kind = str(prim.GetTypeName()), ",".join(map(str, prim.GetAppliedSchemas())), name
            chosen.setdefault(kind, f"{prim.GetPath()}.{name}")
    return sorted(chosen.values())


def mutate(path: Path, mutation: Mutation) -> None:
    """Author one mutation into the layer file at `path`."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(path.read_text())
    _author(layer, mutation)
    path.write_text(layer.ExportToString())


def _author(layer: Sdf.Layer, mutation: Mutation) -> None:
    at = Sdf.Path(mutation.path)
    prim = Sdf.CreatePrimInLayer(layer, at.GetPrimPath())
    old = layer.GetObjectAtPath(at)
    if old:
        prim.RemoveProperty(old)
    if mutation.shape == "relationship":
        Sdf.RelationshipSpec(prim, at.name).targetPathList.explicitItems = [Sdf.Path("/Room/nowhere")]
        return
    kind, value = VALUES[mutation.value]
    spec = Sdf.AttributeSpec(prim, at.name, kind)
    if mutation.shape == "connection":
        spec.connectionPathList.explicitItems = [Sdf.Path("/Room/nowhere.out"), Sdf.Path("/Room/Objects/bed.x")]
    elif mutation.shape == "sample":
        layer.SetTimeSample(spec.path, 1.0, value)
    else:
        spec.default = value


Command = Callable[[Path, Path], list[str]]
COMMANDS: dict[str, Command] = {
    "graph": lambda room, out: ["graph", f"{room}"],
    "graph --json": lambda room, out: ["graph", f"{room}", "--json"],
    "graph -o": lambda room, out: ["graph", f"{room}", "-o", f"{out}.png"],
    "new": lambda room, out: ["new", f"{out}.yaml", "--from", f"{room}", "--force"],
    "check": lambda room, out: ["check", f"{room}"],
    "check --json": lambda room, out: ["check", f"{room}", "--json"],
    "render": lambda room, out: ["render", f"{room}", "-o", f"{out}.png", "--size", "16"],
    "render top": lambda room, out: ["render", f"{room}", "-o", f"{out}.png", "--size", "16", "--view", "top"],
    "usdz": lambda room, out: ["export", f"{room}", "-o", f"{out}.usdz", "--force"],
    "glb": lambda room, out: ["export", f"{room}", "-o", f"{out}.glb", "--force"],
    "usda": lambda room, out: ["export", f"{room}", "-o", f"{out}.usda", "--force"],
    "generate": lambda room, out: ["generate", f"{room}", "-o", f"{out}_made", "--shapes", "boxes", "--no-place"],
    "edit": lambda room, out: [
        "edit", f"{room}", "--add", "stool:nightstand", "-o", f"{out}_edited", "--shapes", "boxes", "--no-place",
    ],
}  # fmt: skip
