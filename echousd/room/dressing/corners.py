"""What stands where nobody walks in a full room: plants and vases in corners, a pouf, slippers, the cables of lamps."""

from __future__ import annotations

import numpy as np
import shapely

from echomodel.data.dressing import KINDS, usual_size
from echomodel.openings import inward_normal
from echousd.room.dressing.setting import Setting, Standing, Thing

GREEN = 2  # plants that a room has at most, those of the graph counted
FOOT = 0.1  # metres from a lamp's middle to where its cable leaves the foot
AROUND = 0.06  # metres of air around what stands in a corner


def corner_plants(setting: Setting) -> None:
    """Tall plants in free corners, a floor vase where there are plants enough."""
    if not setting.full:
        return
    green = len(setting.of("plant"))
    for corner in range(len(setting.floor)):
        rng = setting.rng(f"corner {corner}", "plant")
        kind = "floor_plant" if green < GREEN else "floor_vase"
        if any(t.kind == "floor_vase" for t in setting.placed):
            return
        size, variant = usual_size(kind, rng), int(rng.integers(1 << 30))
        inside = [inward_normal(setting.floor, edge) for edge in (corner - 1, corner)]
        if abs(float(inside[0] @ inside[1])) > 0.5:
            continue
        for off in (0.1, 0.2):
            spot = setting.floor[corner] + (inside[0] + inside[1]) * (float(size[0]) / 2 + off)
            thing = Thing(kind, size, np.array([spot[0], 0.0, spot[1]]), float(rng.uniform(-3, 3)), "", variant)
            if setting.clear(thing, margin=AROUND):
                setting.placed.append(thing)
                green += 1
                break


def poufs(setting: Setting) -> None:
    """A pouf before a corner of the rug that a sofa or an armchair stands on."""
    if not setting.full:
        return
    for host in setting.of("sofa", "armchair", "lounge_chair"):
        rng = setting.rng(host.name, "pouf")
        size, variant = usual_size("pouf", rng), int(rng.integers(1 << 30))
        w, _, d = host.size
        for x in (w / 2 + 0.45, -w / 2 - 0.45):
            for z in (d / 2 + 0.35, d / 2 + 0.8, 0.0):
                spot = host.to_room(np.array([[x, 0.0, z]]))[0]
                spot[1] = 0.0
                thing = Thing("pouf", size, spot, host.yaw, "", variant)
                if setting.clear(thing, margin=0.25):
                    setting.placed.append(thing)
                    return


def slippers(setting: Setting) -> None:
    """Slippers beside every bed, toes away from it."""
    if not setting.full:
        return
    for host in setting.of("bed"):
        rng = setting.rng(host.name, "slippers")
        size, variant = usual_size("slippers", rng), int(rng.integers(1 << 30))
        w, _, d = host.size
        for side in (1, -1):
            for z in (0.0, 0.15 * d, -0.15 * d, 0.35 * d):
                spot = host.to_room(np.array([[side * (w / 2 + 0.22), 0.0, z]]))[0]
                spot[1] = 0.0
                yaw = host.yaw + side * np.pi / 2 + float(rng.uniform(-0.2, 0.2))
                thing = Thing("slippers", size, spot, yaw, "", variant)
                if setting.clear(thing, margin=0.02):
                    setting.placed.append(thing)
                    break


def cables(setting: Setting) -> None:
    """The cable of every lamp that stands on the floor, to the nearest wall, where it lies free."""
    if not (setting.full and setting.walls):
        return
    for host in setting.of("floor_lamp"):
        rng = setting.rng(host.name, "cable")
        for thing in _ways_to_walls(setting, host, rng):
            if setting.clear(thing, host=host.name, margin=0.004) and not _on_rug(setting, thing):
                setting.placed.append(thing)
                break


def _ways_to_walls(setting: Setting, host: Standing, rng: np.random.Generator) -> list[Thing]:
    """Cables straight to the walls, the nearest first."""
    start = host.position[[0, 2]]
    out, variant = [], int(rng.integers(1 << 30))
    for edge in range(len(setting.floor)):
        inside = inward_normal(setting.floor, edge)
        off = float((start - setting.floor[edge]) @ inside)
        length = round(off - FOOT - 0.016, 3)
        if not 0.12 < length < KINDS["cable"].high[2]:
            continue
        size = np.array([round(min(0.12, 0.04 + 0.06 * length), 3), KINDS["cable"].low[1], length])
        middle = start - inside * (off - 0.016 - length / 2)
        yaw = float(np.arctan2(inside[0], inside[1]))
        out.append(Thing("cable", size, np.array([middle[0], 0.0, middle[1]]), yaw, host.name, variant))
    return sorted(out, key=lambda thing: float(thing.size[2]))


def _on_rug(setting: Setting, thing: Thing) -> bool:
    rugs = [t.footprint for t in setting.placed if KINDS[t.kind].name == "rug"]
    return shapely.union_all(rugs).intersects(thing.footprint) if rugs else False
