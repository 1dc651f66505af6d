"""What large bare rooms get: pictures on long empty stretches of wall, plants and vases in empty corners."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import shapely

from echomodel.dressing import usual_size
from echomodel.openings import inward_normal
from echousd.dressing.corners import AROUND, GREEN
from echousd.dressing.setting import Setting, Thing
from echousd.dressing.walls import EYE, Wall, hung_at, walls_of

STRETCH, LONG = 1.9, 3.2  # metres of bare wall that ask for a picture, and for three of them
STEP = 0.1  # metres from spot to spot along a wall
PROBE = np.array([0.3, 0.8, 0.03])  # a picture that tells whether a spot is bare
EMPTY = 0.8  # metres around a corner where nothing stands
FLOORS = (12.0, 22.0, 34.0)  # m² of floor from which on one, two, three corners get something


def bare_walls(setting: Setting) -> None:
    """A picture as wide as suits the stretch on the two longest bare ones, three equal ones where it is very long."""
    if not setting.walls or setting.use:
        return
    found = [(length, middle, wall) for wall in walls_of(setting) for length, middle in stretches(setting, wall)]
    for length, middle, wall in sorted(found, key=lambda one: -one[0])[: None if setting.full else 2]:
        rng = setting.rng(f"wall {wall.edge}", "bare")
        wide = float(np.clip(0.3 * length, 0.6, 1.0))
        size = np.round([wide, wide * rng.uniform(0.66, 0.75), 0.03], 2)
        spots = [middle]
        if length > LONG:
            size = np.array([0.5, 0.68, 0.03])
            spots = [middle + step * 0.66 for step in (-1, 0, 1)]
        variant = int(rng.integers(1 << 30))
        low = EYE - float(size[1]) / 2
        row = [hung_at(setting, wall, spot, "picture", size, low, variant + n, "") for n, spot in enumerate(spots)]
        setting.placed += [one for one in row if one is not None] if None not in row else []


def stretches(setting: Setting, wall: Wall) -> list[tuple[float, float]]:
    """Length and middle (metres along the wall) of its longest bare stretch at eye height, [] where it is short."""
    spots = np.arange(0.3, wall.length - 0.25, STEP)
    low = EYE - float(PROBE[1]) / 2
    bare = [hung_at(setting, wall, float(spot), "picture", PROBE, low, 0, "") is not None for spot in spots]
    runs = [[n for n, _ in run] for free, run in groupby(enumerate(bare), key=lambda one: one[1]) if free]
    ends = [(float(spots[run[0]]), float(spots[run[-1]])) for run in runs]
    long = [(last - first + float(PROBE[0]), (first + last) / 2) for first, last in ends]
    return [one for one in sorted(long)[-1:] if one[0] >= STRETCH]


def bare_corners(setting: Setting) -> None:
    """Plants, then a tall vase, in the emptiest corners of rooms that are large for what stands in them."""
    green = setting.plants
    wanted = sum(setting.room.area >= area for area in FLOORS) - green
    if setting.full or wanted <= 0:
        return
    around = [other.footprint for other in setting.objects.values() if other.position[1] < 0.5]
    away = [min((shapely.Point(corner).distance(plan) for plan in around), default=9.0) for corner in setting.floor]
    for number in np.argsort(away)[::-1].tolist():
        inside = [inward_normal(setting.floor, edge) for edge in (number - 1, number)]
        if wanted <= 0 or away[number] < EMPTY or abs(float(inside[0] @ inside[1])) > 0.5:
            continue
        rng = setting.rng(f"corner {number}", "bare")
        kind = "floor_plant" if green < GREEN else "floor_vase"
        size, variant = usual_size(kind, rng), int(rng.integers(1 << 30))
        middles = [setting.floor[number] + (inside[0] + inside[1]) * (float(size[0]) / 2 + off) for off in (0.1, 0.2)]
        turn = float(rng.uniform(-3, 3))
        things = (Thing(kind, size, np.array([x, 0.0, z]), turn, "", variant) for x, z in middles)
        if setting.put_first(things, margin=AROUND) is not None:
            green, wanted = green + 1, wanted - 1
