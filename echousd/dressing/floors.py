"""What lies and stands on the floor: rugs, clusters by furniture; what stands in corners where nobody walks."""

from collections.abc import Iterator
from itertools import product

import numpy as np
import shapely

from echomodel.boxes2d import seen, turned
from echomodel.dressing import KINDS, names_of, usual
from echousd.dressing.setting import Setting, Standing, Thing, around, rectangle
from echousd.dressing.stories import Wish
from echousd.dressing.walls import walls_of

PILE = 0.012  # metres; furniture stands on the floor below, through the rug
FROM_WALL = 0.12
LARGEST, ALONE = (4.2, 3.4), (2.6, 1.7)  # metres: of rugs, and of one that nothing stands on
LEAST, SHOWS = 1.2, 0.3  # m² of a rug; metres by which it is wider than what stands on it
LEGS, BEYOND = 0.3, 0.45  # metres from the front of a seat that a rug carries, where its legs stand; around a group
RUGS, BETWEEN = 3, 0.4  # of a room, and metres from a rug to what has one of its own
RUNNER = 2.1  # times as long as wide
OVALS, ROUNDS = 0.1, 0.25  # shares of rugs, of those that are about square
AROUND = 1.2  # metres from a table: a seat that belongs to it
# Of half its wished width and depth that a rug may have: (n, 2) about its middle, (m, 2, 2) to each of its sides.
SHARES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
SHRUNK = np.array(list(product(SHARES, repeat=2)))
SIDES = np.array(list(product(SHARES, repeat=4))).reshape(-1, 2, 2) * [[-1], [1]]


def rugs(setting: Setting) -> None:
    """One rug below every sofa group, bed and dining table that has room for it; else below the table that armchairs
    stand around, below armchairs or before the only desk; between the furniture where none of these has one. Then, up
    to `RUGS` in all, at armchairs and that desk where none is near."""
    hosts = sorted(setting.of("rug"), key=lambda o: -float(o.size[0] * o.size[2]))
    seats = [o for o in hosts if o.row.role == "seat"]
    desks = [o for o in hosts if o.row.role == "board" and o.row.access]
    shared = [o for o in setting.stands("before") if sum(o.footprint.distance(s.footprint) < AROUND for s in seats) > 1]
    groups = [o for o in hosts if o not in seats and o not in desks] or shared
    for host in groups:
        _lay(setting, host)
    if groups:
        _between(setting)
    for host in seats + desks * (len(desks) == 1):
        if len(setting.placed) < RUGS and not host.footprint.distance(_rugs(setting)) < BETWEEN:
            _lay(setting, host)
    _between(setting)


def _lay(setting: Setting, host: Standing) -> None:
    """A rug at a piece, as large as there is room for; at a sofa each of its sides goes as far as it may."""
    low, high = _wished(setting, host)
    sofa, middle, half = host.row.role == "sofa", (low + high) / 2, np.minimum(high - low, LARGEST) / 2
    group = setting.of("seat", "light", "decor", "sofa" if sofa else "seat")
    free = _free(setting, [host, *group, *setting.stands("head", "before", "beside")])
    ends = half * (SIDES if sofa else np.stack([-SHRUNK, SHRUNK], 1)) + middle
    plans = turned(ends[:, [[0, 0], [1, 0], [1, 1], [0, 1]], [0, 1]], np.array(host.yaw)) + host.position[[0, 2]]
    wide, deep = (ends[:, 1] - ends[:, 0]).T
    area = np.where((wide > host.size[0] + SHOWS) | sofa, wide * deep, 0.0)
    for number in np.argsort(-area, kind="stable")[: int((area >= LEAST).sum())]:
        if free.contains(shapely.Polygon(plans[number])):
            extents = np.round([wide[number], deep[number]], 2)
            setting.placed.append(_rug(setting, host, host.on_floor(*ends[number].mean(0)), extents))
            return


def _between(setting: Setting) -> None:
    """A rug along the room near its middle, below seats at most, where there is none."""
    if setting.placed or setting.use:
        return
    free, low, high = _free(setting, setting.of("seat")), setting.floor.min(0), setting.floor.max(0)
    middles = np.stack(np.meshgrid(*np.linspace(low, high, 16).T), -1).reshape(-1, 2)
    middles = middles[np.argsort(np.linalg.norm(middles - (low + high) / 2, axis=1))]
    whole = np.minimum(high - low - 2 * FROM_WALL, ALONE if high[0] - low[0] > high[1] - low[1] else ALONE[::-1])
    for extents in np.round(whole * SHRUNK[np.argsort(-SHRUNK.prod(1), kind="stable")], 2):
        lies = shapely.contains(free, shapely.box(*(middles - extents / 2).T, *(middles + extents / 2).T))
        if lies.any():
            x, z = middles[lies.argmax()]
            setting.placed.append(_rug(setting, None, np.array([x, 0.0, z]), extents))
            return


def _rug(setting: Setting, host: Standing | None, spot: np.ndarray, extents: np.ndarray) -> Thing:
    """A rug of a design new to the room, along its longer side; below a seat and on some squares round."""
    of, own, role = (host.name, host.yaw, host.row.role) if host else ("", 0.0, "")
    rng, (short, long) = setting.rng(of, "rug"), np.sort(extents)
    form = "runner" if long > RUNNER * short else "rug"
    if form == "rug" and role != "board":  # chairs around a table would be half off a round one
        form = "oval" if rng.random() < OVALS else form
        if long < 1.3 * short and (role == "seat" or rng.random() < ROUNDS):
            form, long = "round", short
    names = names_of("rug", form, rng.choice((setting.resident, "")), setting.style)
    new = [name for name in names if all(thing.kind != name for thing in setting.placed)]
    yaw = own if extents[0] >= extents[1] else own + np.pi / 2
    return Thing(str(rng.choice(new or names)), np.array([long, PILE, short]), spot, yaw, of)


def _wished(setting: Setting, host: Standing) -> tuple[np.ndarray, np.ndarray]:
    """(2,) each: the lower and upper corner of the rug that a group would have, in the host's frame."""
    w, _, d = (float(v) for v in host.size)
    if host.row.role == "bed":
        end = d / 2 + 0.45
        return np.array([-w / 2 - 0.65, end - min(d * 0.75 + 0.5, 2.4)]), np.array([w / 2 + 0.65, end])
    if host.row.role == "seat":
        return np.array([-w / 2 - 0.45, -d / 2 - 0.15]), np.array([w / 2 + 0.45, d / 2 + 0.65])
    if host.row.access and host.row.role != "sofa":  # a desk, which may stand at a wall
        return np.array([-w / 2 - 0.45, d / 2 - 0.45]), np.array([w / 2 + 0.45, d / 2 + 1.05])
    if host.row.role != "sofa":
        return np.array([-w / 2 - 0.65, -d / 2 - 0.65]), np.array([w / 2 + 0.65, d / 2 + 0.65])
    tables = [o for o in setting.stands("before") if host.footprint.distance(o.footprint) < AROUND]
    seats = [o for o in setting.of("rug") if o.row.role in ("seat", "sofa") and o is not host]
    near = [o for o in seats if any(o.footprint.distance(one.footprint) < AROUND for one in (host, *tables))]
    held = np.array([[-w / 2 - BEYOND, d / 2 - LEGS], [w / 2 + BEYOND, d / 2 + 1.75]])
    middles = [o.on_floor(0, (o.size[2] - LEGS) / 2)[[0, 2]] for o in near]
    fronts = [rectangle(at, np.array([o.size[0], LEGS]), o.yaw) for at, o in zip(middles, near, strict=True)]
    for plan, beyond in [(o.footprint, BEYOND) for o in tables] + [(front, 0.05) for front in fronts]:
        at = seen(shapely.get_coordinates(plan) - host.position[[0, 2]], np.array(host.yaw))
        held = np.array([np.minimum(held[0], at.min(0) - beyond), np.maximum(held[1], at.max(0) + beyond)])
    return held[0], held[1]


def _free(setting: Setting, group: list[Standing]) -> shapely.Geometry:
    """Where a rug may lie: inside the room, away from doors and other rugs, and below nobody but its group."""
    others = (o.footprint for o in setting.objects.values() if o not in group and o.position[1] < 0.05)
    rugs = (thing.footprint.buffer(0.1) for thing in setting.placed)
    return setting.room.buffer(-FROM_WALL).difference(
        shapely.union_all([*others, *rugs, *(w for w, _ in setting.ways)])
    )


def clusters(setting: Setting) -> None:
    """What lies on the floor beside furniture, in large rooms at several pieces; nothing alone on bare floor."""
    rugs = _rugs(setting)
    for number, wish in enumerate(setting.story.floor):
        left = setting.parts
        for host in setting.of(wish.by):
            rng = setting.rng(host.name, "floor", str(number))
            if not setting.has(wish.share, rng):
                continue
            near = host.footprint.buffer(NEAR).union(rugs)
            first = setting.put_first((t for t in _by(host, wish, rng) if near.intersects(t.footprint)), margin=0.03)
            if first is None:
                continue
            for kind in (str(rng.choice(among)) for among in wish.beside):
                (size, variant), turn = usual(kind, rng), float(rng.uniform(-3, 3))
                places = first.position + np.insert(1.15 * around(first, size, rng), 1, 0.0, axis=1)
                setting.put_first((Thing(kind, size, place, turn, "", variant) for place in places), margin=0.02)
            left -= 1
            if not left:
                break


def _by(host: Standing, wish: Wish, rng: np.random.Generator) -> Iterator[Thing]:
    """A wished thing at each of its places beside furniture."""
    size, variant = usual(kind := str(rng.choice(wish.of)), rng)
    lean = float(rng.uniform(-3, 3) if wish.turn == "any" else rng.uniform(-0.2, 0.2))
    for x, z, dx, dz in wish.at:
        place = host.on_floor(x * host.size[0] / 2 + dx, z * host.size[2] / 2 + dz)
        away = float(np.sign(dx)) * np.pi / 2 if wish.turn == "out" else 0.0
        yield Thing(kind, size, place, host.yaw + lean + away, "", variant)


GREEN = 2  # plants that a room has at most, those of the graph counted
FOOT = 0.1  # metres from a lamp's middle to where its cable leaves the foot
CORNER_AIR = 0.06  # metres of air around what stands in a corner
NEAR = 0.35  # metres from furniture: nothing else stands on bare floor alone


def cables(setting: Setting) -> None:
    """The cable of every lamp that stands on the floor, to the nearest wall, where it lies free."""
    if not (setting.full and setting.walls):
        return
    rugs = _rugs(setting)
    for host in (lamp for lamp in setting.of("light") if lamp.row.support == "floor"):
        rng = setting.rng(host.name, "cable")
        ways = (thing for thing in _ways_to_walls(setting, host, rng) if not rugs.intersects(thing.footprint))
        setting.put_first(ways, host=host.name, margin=0.004)


def _ways_to_walls(setting: Setting, host: Standing, rng: np.random.Generator) -> list[Thing]:
    """Cables straight to the walls, the nearest first."""
    start, out, variant = host.position[[0, 2]], list[Thing](), int(rng.integers(1 << 30))
    for wall in walls_of(setting.floor):
        off = float((start - wall.start) @ wall.inside)
        length = round(off - FOOT - 0.016, 3)
        if not 0.12 < length < KINDS["cable"].high[2]:
            continue
        size = np.array([round(min(0.12, 0.04 + 0.06 * length), 3), KINDS["cable"].low[1], length])
        x, z = start - wall.inside * (off - 0.016 - length / 2)
        out.append(Thing("cable", size, np.array([x, 0.0, z]), wall.yaw, host.name, variant))
    return sorted(out, key=lambda thing: float(thing.size[2]))


def _rugs(setting: Setting) -> shapely.Geometry:
    """What rugs cover."""
    return shapely.union_all([thing.footprint for thing in setting.placed if KINDS[thing.kind].name == "rug"])
