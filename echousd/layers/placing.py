"""Where objects stand, as transforms on a stage: one layout, or several as variants."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd, UsdGeom

from echousd.room import RoomData
from echousd.stage.paths import OBJECTS


def place_layouts(stage: Usd.Stage, room: RoomData) -> None:
    """Author the objects' xformOps, as variants `layout_0` ... where there are several."""
    layouts = room.layouts or (room.boxes,)
    if len(layouts) == 1:
        _place(stage, room, 0)
        return
    variants = stage.GetPrimAtPath("/Room").GetVariantSets().AddVariantSet("layout")
    for number in range(len(layouts)):
        name = f"layout_{number}"
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            _place(stage, room, number)
    variants.SetVariantSelection("layout_0")


def _place(stage: Usd.Stage, room: RoomData, layout: int) -> None:
    boxes = room.layouts[layout] if room.layouts else room.boxes
    for number, name in enumerate(room.names):
        xform = UsdGeom.Xformable(stage.OverridePrim(f"{OBJECTS}/{name}"))
        x, y, z = (round(float(v), 5) + 0.0 for v in boxes.position[number])
        z_up = room.options.up_axis == "Z"
        xform.AddTranslateOp().Set(Gf.Vec3d(x, 0.0 - z, y) if z_up else Gf.Vec3d(x, y, z))
        turn = xform.AddRotateZOp() if z_up else xform.AddRotateYOp()
        turn.Set(round(float(np.degrees(float(boxes.yaw[number]))), 4) + 0.0)
