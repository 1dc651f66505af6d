"""The index stage of a run: every room as a payload on a grid, so that a whole night opens as one stage."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Usd, UsdGeom

from echousd.stage.files import layer_bytes, write_whole

INDEX = "index.usda"
GAP = 2.0  # metres between two rooms


def write_index(folder: Path, rows: Iterable[dict[str, Any]]) -> Path:
    """Write `index.usda`; rooms are payloads, so that it opens without them (`Usd.Stage.LoadNone`).

    Arguments:
        rows: of the manifest; those without a room take no place.
    """
    made = [row for row in rows if row["state"] == "done"]
    width = max(
        (max(row["bounds"][3] - row["bounds"][0], row["bounds"][5] - row["bounds"][2]) for row in made), default=0
    )
    pitch, columns = math.ceil(width + GAP), max(1, math.ceil(math.sqrt(len(made))))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/Rooms").GetPrim())
    with Sdf.ChangeBlock():
        for number, row in enumerate(made):
            prim = Sdf.CreatePrimInLayer(layer, f"/Rooms/{row['id']}")
            prim.specifier, prim.typeName = Sdf.SpecifierDef, "Xform"
            prim.payloadList.Prepend(Sdf.Payload(f"./{row['root']}"))
            low, high = row["bounds"][:3], row["bounds"][3:]
            middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
            at = Gf.Vec3d(number % columns * pitch - middle[0], 0, number // columns * pitch - middle[2])
            move = Sdf.AttributeSpec(prim, "xformOp:translate:grid", Sdf.ValueTypeNames.Double3)
            move.default = at
            order = Sdf.AttributeSpec(prim, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
            order.default = ["xformOp:translate:grid"]
    write_whole(folder / INDEX, layer_bytes(layer, ".usda"))
    return folder / INDEX
