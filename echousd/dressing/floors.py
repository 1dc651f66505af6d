"""What lies and stands on the floor: rugs, shoes, clusters by furniture; what stands in corners where nobody walks."""

from __future__ import annotations

import numpy as np
import shapely

from echomodel.dressing import KINDS, usual_size
from echomodel.dressing.prints import names_of
from echomodel.openings import hinge_point, inward_normal
from echousd.dressing.setting import Setting, Standing, Thing, around, rectangle
from echousd.dressing.stories import Wish

PILE = 0.008  # metres; furniture stands on the floor below, through the rug
FROM_WALL = 0.12
SHOES = 0.25  # share of rooms with a door that somebody leaves shoes at
LARGEST = (4.0, 3.0)
RUNNER = 2.1  # times as long as wide
OVALS, ROUNDS = 0.1, 0.25  # shares of rugs, of those that are about square
AROUND = 1.2  # metres from a table: a seat that belongs to it
SHARES = (1.0, 0.9, 0.8, 0.7, 0.6)  # of its wished width and depth that a rug may have, the largest area first
SHRUNK = sorted(((x, z) for x in SHARES for z in SHARES), key=lambda share: -share[0] * share[1])


def rugs(setting: Setting) -> None:
    """One rug below every sofa group, bed and dining table that has room for it; else below the table that armchairs
    stand around, below an armchair or a desk."""
    done: list[shapely.Polygon] = []
    hosts = setting.inviting("rug")
    seats = [o for o in hosts if o.row.role == "seat"]
    desks = [o for o in hosts if o.row.role == "board" and o.row.access]
    near = {o.name: sum(o.footprint.distance(s.footprint) < AROUND for s in seats) for o in setting.stands("before")}
    shared = [o for o in setting.stands("before") if near[o.name] > 1]
    groups = [o for o in hosts if o not in seats and o not in desks] or shared or seats or desks
    for host in sorted(groups, key=lambda o: -float(o.size[0] * o.size[2])):
        group, centre, size = _under(setting, host)
        if np.prod(size) < 1.2:
            continue
        for share in SHRUNK:
            extents = np.round(np.minimum(np.array(size) * share, LARGEST), 2)
            spot = host.on_floor(*centre)
            plan = rectangle(spot[[0, 2]], extents, host.yaw)
            if _lies(setting, plan, group) and not any(plan.intersects(other) for other in done):
                done.append(plan.buffer(0.1))
                setting.placed.append(_rug(setting, host, spot, extents))
                break


def _rug(setting: Setting, host: Standing, spot: np.ndarray, extents: np.ndarray) -> Thing:
    """A rug of a design new to the room, along its longer side; below a seat and on some squares round."""
    rng, (short, long) = setting.rng(host.name, "rug"), np.sort(extents)
    form = "runner" if long > RUNNER * short else "oval" if rng.random() < OVALS else "rug"
    if long < 1.3 * short and (host.row.role == "seat" or rng.random() < ROUNDS):
        form, long = "round", short
    names = names_of("rug", form, rng.choice((setting.resident, "")))
    new = [name for name in names if all(thing.kind != name for thing in setting.placed)]
    yaw = host.yaw if extents[0] >= extents[1] else host.yaw + np.pi / 2
    return Thing(str(rng.choice(new or names)), np.array([long, PILE, short]), spot, yaw, host.name)


def _under(setting: Setting, host: Standing) -> tuple[set[str], tuple[float, float], tuple[float, float]]:
    """Who stands on the rug of a group, the rug's middle in the host's frame and its wished extents."""
    w, _, d = (float(v) for v in host.size)
    if host.row.role == "bed":
        wide, long = w + 1.3, min(d * 0.75 + 0.5, 2.4)
        near = {o.name for o in (*setting.of("seat"), *setting.stands("head"))}
        return {host.name, *near}, (0.0, d / 2 + 0.45 - long / 2), (wide, long)
    if host.row.role == "seat":
        wide, long = w + 0.9, d + 0.8
        near = {o.name for o in (*setting.of("seat", "light", "decor"), *setting.stands("before", "beside"))}
        return {host.name, *near}, (0.0, 0.25), (wide, long)
    if host.row.role == "sofa":
        front = d / 2
        tables = [o for o in setting.stands("before") if host.footprint.distance(o.footprint) < AROUND]
        reach = 1.7
        for table in tables[:1]:
            _, ahead = host.in_plan(table.position)
            reach = float(np.clip(ahead - front, 0.4, 1.3)) + float(table.size[2]) / 2 + 0.45
        around = {o.name for o in (*setting.of("seat", "sofa", "light", "decor"), *setting.stands("before", "beside"))}
        long = reach + 0.3
        return {host.name, *around}, (0.0, front - 0.3 + long / 2), (w + 0.5, long)
    seats = {o.name for o in setting.of("seat")}
    return {host.name, *seats}, (0.0, 0.0), (w + 1.2, d + 1.2)


def _lies(setting: Setting, plan: shapely.Polygon, group: set[str]) -> bool:
    """Inside the room, away from doors, and below nobody but its group."""
    if not setting.room.buffer(-FROM_WALL).contains(plan):
        return False
    if any(way.intersects(plan) for way, _ in setting.ways):
        return False
    return not any(
        other.footprint.intersects(plan)
        for other in setting.objects.values()
        if other.name not in group and other.position[1] < 0.05
    )


def by_doors(setting: Setting) -> None:
    """A pair of shoes beside a door, toes to the wall, now and then."""
    for _, door in setting.ways:
        if door.kind != "door" or not setting.walls or setting.use:
            continue
        rng = setting.rng(door.name, "shoes")
        if rng.random() > SHOES:  # of rooms, not of doors
            return
        size = usual_size("shoes", rng)
        hinge, closed = hinge_point(setting.floor, door)
        inside = inward_normal(setting.floor, door.edge)
        yaw = float(np.arctan2(-inside[0], -inside[1])) + float(rng.uniform(-0.15, 0.15))
        along = (door.width + 0.3, door.width + 0.45, door.width + 0.65, -0.3, -0.5)
        middles = [hinge + closed * share + inside * (size[2] / 2 + 0.05) for share in along]
        pairs = (
            Thing("shoes", size, np.array([x, 0.0, z]), yaw, variant=int(rng.integers(1 << 30))) for x, z in middles
        )
        if setting.put_first(pairs, margin=0.03):
            return


def clusters(setting: Setting) -> None:
    """What lies on the floor beside furniture, as its story has it; nothing alone on bare floor."""
    rugs = shapely.union_all([t.footprint for t in setting.placed if KINDS[t.kind].name == "rug"])
    for number, wish in enumerate(setting.story.floor):
        for host in setting.near(wish.by):
            rng = setting.rng(host.name, "floor", str(number))
            if not setting.has(wish.share, rng):
                continue
            near = host.footprint.buffer(NEAR).union(rugs)
            first = setting.put_first((t for t in _by(host, wish, rng) if near.intersects(t.footprint)), margin=0.03)
            if first is None:
                continue
            for kind in wish.beside:
                size, turn, variant = usual_size(kind, rng), float(rng.uniform(-3, 3)), int(rng.integers(1 << 30))
                places = first.position + np.insert(1.15 * around(first, size, rng), 1, 0.0, axis=1)
                setting.put_first((Thing(kind, size, place, turn, "", variant) for place in places), margin=0.02)
            break


def _by(host: Standing, wish: Wish, rng: np.random.Generator) -> list[Thing]:
    """A wished thing at each of its places beside furniture."""
    kind, variant = str(rng.choice(wish.of)), int(rng.integers(1 << 30))
    size, lean = usual_size(kind, rng), float(rng.uniform(-3, 3) if wish.turn == "any" else rng.uniform(-0.2, 0.2))
    out = []
    for x, z, dx, dz in wish.at:
        place = host.on_floor(x * host.size[0] / 2 + dx, z * host.size[2] / 2 + dz)
        away = float(np.sign(dx)) * np.pi / 2 if wish.turn == "out" else 0.0
        out.append(Thing(kind, size, place, host.yaw + lean + away, "", variant))
    return out


GREEN = 2  # plants that a room has at most, those of the graph counted
FOOT = 0.1  # metres from a lamp's middle to where its cable leaves the foot
CORNER_AIR = 0.06  # metres of air around what stands in a corner
NEAR = 0.35  # metres from furniture: nothing else stands on bare floor alone


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
