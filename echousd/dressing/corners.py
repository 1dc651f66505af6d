"""What stands where nobody walks in a full room: plants and vases in corners, a pouf, slippers, the cables of lamps."""

from __future__ import annotations

import numpy as np
import shapely

from echomodel.dressing import KINDS, usual_size
from echomodel.openings import inward_normal
from echousd.dressing.setting import Setting, Standing, Thing

GREEN = 2  # plants that a room has at most, those of the graph counted
FOOT = 0.1  # metres from a lamp's middle to where its cable leaves the foot
AROUND = 0.06  # metres of air around what stands in a corner
SLIPPERS = 0.4  # share of beds that have some


def corner_plants(setting: Setting) -> None:
    """Tall plants in free corners, a floor vase where there are plants enough."""
    if not setting.full:
        return
    green = setting.plants
    for corner in range(len(setting.floor)):
        rng = setting.rng(f"corner {corner}", "plant")
        kind = "floor_plant" if green < GREEN else "floor_vase"
        if any(t.kind == "floor_vase" for t in setting.placed):
            return
        size, variant = usual_size(kind, rng), int(rng.integers(1 << 30))
        inside = [inward_normal(setting.floor, edge) for edge in (corner - 1, corner)]
        if abs(float(inside[0] @ inside[1])) > 0.5:
            continue
        middles = [setting.floor[corner] + (inside[0] + inside[1]) * (float(size[0]) / 2 + off) for off in (0.1, 0.2)]
        wanted = (Thing(kind, size, np.array([x, 0.0, z]), float(rng.uniform(-3, 3)), "", variant) for x, z in middles)
        green += setting.put_first(wanted, margin=AROUND) is not None


def poufs(setting: Setting) -> None:
    """A pouf before a corner of the rug that a sofa or an armchair stands on."""
    if not setting.full:
        return
    for host in setting.inviting("pouf"):
        rng = setting.rng(host.name, "pouf")
        size, variant = usual_size("pouf", rng), int(rng.integers(1 << 30))
        w, _, d = host.size
        spots = [(x, z) for x in (w / 2 + 0.45, -w / 2 - 0.45) for z in (d / 2 + 0.35, d / 2 + 0.8, 0.0)]
        wanted = (Thing("pouf", size, host.on_floor(x, z), host.yaw, "", variant) for x, z in spots)
        if setting.put_first(wanted, margin=0.25):
            return


def slippers(setting: Setting) -> None:
    """Slippers beside a bed, toes away from it."""
    if not setting.full:
        return
    for host in setting.of("bed"):
        rng = setting.rng(host.name, "slippers")
        size, variant = usual_size("slippers", rng), int(rng.integers(1 << 30))
        w, _, d = host.size
        if rng.random() > SLIPPERS:
            continue
        for side in (1, -1):
            x, yaw = side * (w / 2 + 0.22), host.yaw + side * np.pi / 2
            wanted = (
                Thing("slippers", size, host.on_floor(x, z), yaw + float(rng.uniform(-0.2, 0.2)), "", variant)
                for z in (0.0, 0.15 * d, -0.15 * d, 0.35 * d)
            )
            setting.put_first(wanted, margin=0.02)


def cables(setting: Setting) -> None:
    """The cable of every lamp that stands on the floor, to the nearest wall, where it lies free."""
    if not (setting.full and setting.walls):
        return
    for host in (lamp for lamp in setting.of("light") if lamp.row.support == "floor"):
        rng = setting.rng(host.name, "cable")
        ways = (thing for thing in _ways_to_walls(setting, host, rng) if not _on_rug(setting, thing))
        setting.put_first(ways, host=host.name, margin=0.004)


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
