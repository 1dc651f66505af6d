"""What hangs on walls: curtains, pictures and mirrors; in a full room shelves, a clock and coats, too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from echomodel.boxes2d import axes
from echomodel.dressing import KINDS, printed, usual_size
from echomodel.dressing import thing as solids_of
from echomodel.openings import Opening, direction, edge_lengths, inward_normal
from echousd.dressing.setting import Setting, Standing, Thing, rectangle, standing
from echousd.dressing.tabletops import stocked, surfaces
from echousd.shapes.fittings import NICHE, RAIL
from echousd.shapes.geometry import Origin
from echousd.shapes.joinery import assembled

EYE = 1.52  # metres, height of a picture's middle on an empty wall
OVER, LOWEST = 0.22, 1.15  # metres between furniture and what hangs over it, which hangs no lower
ASIDE = (0.0, 0.4, -0.4)  # to which side of its middle: shares of the width that what hangs there leaves
NEAR = 0.45  # metres: furniture whose back is so near to a wall stands at it
SIDE = 0.32  # metres that curtains take beside a window
RADIATORS = ("panel_radiator", "panel_radiator", "flat_radiator", "column_radiator")  # without a style
BELOW, BEHIND = 0.14, 0.03  # metres of air between a window's sill and a radiator, and behind it
PLUGGED = ("bed", "desk", "tv_stand")  # words of what has a socket beside it
CURTAINS = ("curtain", "tied_curtain", "eyelet_curtain", "pleated_curtain", "sheer_curtain")  # of a room all are alike
BLINDS = ("blind", "roman_blind", "cafe_curtain")  # as well; where it is wet, the first
# Of how wide a curtain hangs, where something stands beside it; of a rail, how far in it may hang there.
BUNCHED, INWARD = (1.0, 0.75, 0.55), 0.2


@dataclass(frozen=True, eq=False)
class Wall:
    """One wall from inside: its first corner, unit vectors along it and into the room (x, z), its length in metres."""

    edge: int
    start: np.ndarray
    along: np.ndarray
    inside: np.ndarray
    length: float

    @property
    def yaw(self) -> float:
        """Of what hangs on it and looks into the room."""
        return float(np.arctan2(self.inside[0], self.inside[1]))

    def at(self, along: float, off: float, y: float) -> np.ndarray:
        """(3,) a point before the wall."""
        x, z = self.start + self.along * along + self.inside * off
        return np.array([x, y, z])


def walls_of(floor: np.ndarray) -> list[Wall]:
    """All walls around the corners (k, 2) of a floor."""
    every = enumerate(zip(np.asarray(floor, float), edge_lengths(floor).tolist(), strict=True))
    return [
        Wall(k, at, direction(floor, k), inward_normal(floor, k), length) for k, (at, length) in every if length > 0.3
    ]


def curtains(setting: Setting) -> None:
    """A curtain on either side of every window down to the floor; where there is no room for two, a blind in it."""
    if not setting.walls or setting.use == "outdoor":
        return
    above, before, beyond = RAIL
    for wall in walls_of(setting.floor):
        for window in (o for o in setting.openings if o.kind == "window" and o.edge == wall.edge):
            rail = window.sill + window.height + above
            middle, reach = wall.at((window.offset + window.end) / 2, before / 2 + 0.045, 0.0), before + 0.09
            strip = rectangle(middle[[0, 2]], np.array([window.width + 2 * beyond, reach]), wall.yaw)
            tall = any(o.top > rail - 0.03 and o.footprint.intersects(strip) for o in setting.objects.values())
            if setting.use == "wet" or rail > setting.height - 0.05 or tall:
                _blind(setting, wall, window)
                continue
            rng = setting.rng("curtains")
            kind, variant = str(rng.choice(_styled(setting, CURTAINS))), int(rng.integers(1 << 30))
            full = round(min(0.45, 0.16 + 0.14 * window.width), 3)
            low, high = np.clip((window.offset - beyond, window.end + beyond), 0.02, wall.length - 0.02).tolist()
            for wide in (round(full * share, 3) for share in BUNCHED):
                inner = wide / 2 + np.linspace(0.0, INWARD * (high - low), 4)  # where something is beside
                size = np.array([wide, round(rail - 0.01, 3), 0.085])
                sides: list[Thing] = []
                for places in (low + inner, high - inner):
                    hung = (Thing(kind, size, wall.at(x, before, 0.015), wall.yaw, "", variant) for x in places)
                    sides += islice((one for one in hung if setting.clear(one, margin=0.0, floor=False)), 1)
                if len(sides) == 2:  # one alone looks forgotten
                    setting.placed += sides
                    setting.curtained.add(window.name)
                    break
            else:
                _blind(setting, wall, window)


def _styled(setting: Setting, kinds: Sequence[str]) -> Sequence[str]:
    """Those of some curtains that go with the style of a room; all where none is told."""
    return [kind for kind in kinds if kind in setting.style.curtains] if setting.style else kinds


def _blind(setting: Setting, wall: Wall, window: Opening) -> None:
    """A blind, let down over a part of the pane, or a curtain on a rod before its lower half."""
    rng, alike = setting.rng(window.name, "blind"), setting.rng("blinds")
    kinds = BLINDS[:1] if setting.use == "wet" else _styled(setting, BLINDS)
    kind, variant = str(alike.choice(kinds)), int(alike.integers(1 << 30))
    half = kind == "cafe_curtain"
    tall = round(window.height * float(0.52 if half else rng.choice((0.2, 0.3, 0.4))), 3)
    thick = KINDS[kind].low[2]
    size = np.array([round(window.width - 0.012, 3), tall, thick])
    low = 0.012 if half else window.height - 0.004 - tall
    place = wall.at((window.offset + window.end) / 2, thick / 2 - 0.019, window.sill + low)
    setting.placed.append(Thing(kind, size, place, wall.yaw, "", variant))


def radiators(setting: Setting) -> None:
    """A radiator under every window where nothing stands, as wide as curtains leave it; in a room all are alike."""
    if not setting.walls or setting.use == "outdoor":
        return
    kinds, rng = setting.style.radiators if setting.style else RADIATORS, setting.rng("radiators")
    kind, variant = str(rng.choice(kinds)), int(rng.integers(1 << 30))
    low, high = np.array(KINDS[kind].low), np.array(KINDS[kind].high)
    for wall in walls_of(setting.floor):
        for window in (o for o in setting.openings if o.kind == "window" and o.edge == wall.edge):
            tall = round(min(float(high[1]), window.sill - BELOW), 2)
            wide = [round(share * window.width, 2) for share in (0.95, 0.8, 0.65, 0.5)] if tall >= low[1] else ()
            place = wall.at((window.offset + window.end) / 2, low[2] / 2 + BEHIND, 0.0)
            sizes = (np.array([w, tall, low[2]]) for w in wide if low[0] <= w <= high[0])
            setting.put_first((Thing(kind, size, place, wall.yaw, "", variant) for size in sizes), margin=0.02)


def sockets(setting: Setting) -> None:
    """A socket in the wall beside every bed, desk and screen that stands at one."""
    every, rng = walls_of(setting.floor) if setting.walls else [], setting.rng("sockets")
    size, variant = np.array(rng.choice([KINDS["socket"].low, KINDS["socket"].high])), int(rng.integers(1 << 30))
    for host in (one for word in PLUGGED for one in setting.near(word)):
        wall, along = behind(host.size, host.position, host.yaw, every) or (None, 0.0)
        if wall is not None:
            ways = [side * (float(host.size[0]) / 2 + off) for off in (0.15, 0.3, 0.6, 0.8) for side in (1, -1)]
            spots = [(wall, (along + way) / wall.length) for way in ways]
            _hung(setting, Thing("socket", size, np.zeros(3), 0.0, "", variant), spots, 0.3)


def pictures(setting: Setting) -> None:
    """A picture or a mirror over what stands at a wall."""
    if not setting.walls or setting.use:
        return
    every = walls_of(setting.floor)
    for host in setting.inviting("picture", "mirror"):
        wall, along = behind(host.size, host.position, host.yaw, every) or (None, 0.0)
        if wall is None:
            continue
        rng = setting.rng(host.name, "picture")
        for (kind, size), aside in product(_over(host, setting, rng), ASIDE):
            if kind == "picture" and setting.has(GROUPS, rng) and _group(setting, wall, along, host, rng):
                break
            if kind == "picture":
                (kind,) = shown(setting, size, 1, host.name)
            least, variant = host.top + OVER, int(rng.integers(1 << 30))
            low = min(max(least, LOWEST), setting.height - 0.2 - size[1])
            spot = along + aside * max(0.0, float(host.size[0] - size[0]))
            thing = hung_at(setting, wall, spot, kind, size, low, variant, host.name)
            if thing and low > least - 0.1:
                setting.placed.append(thing)
                break


def shown(setting: Setting, size: np.ndarray, count: int, *words: str) -> list[str]:
    """Pictures of one kind that hang together, for who lives there; new to the room while there are enough."""
    hung, rng = {thing.kind for thing in setting.placed}, setting.rng(*words, "shown")
    kinds = list(printed("picture", "wide" if size[0] > size[1] else "tall", setting.resident, setting.style).values())
    series = sorted(kinds, key=lambda names: -(rng.random() ** (1 / len(names))))  # every picture alike often
    new = ([name for name in names if name not in hung] for names in series)
    names = next((names for names in new if len(names) >= count), max(series, key=len) * count)
    return [names[k] for k in rng.permutation(len(names))[:count]]


def _group(setting: Setting, wall: Wall, along: float, host: Standing, rng: np.random.Generator) -> bool:
    """Three equal pictures in a row, or three pairs, over a long piece; all of them or none."""
    wide = float(host.size[0])
    if wide < 1.3:
        return False
    free = setting.height - 0.25 - host.top - OVER
    rows = 2 if free > 1.15 and wide > 1.7 and rng.random() < 0.5 else 1
    w = float(np.clip((0.85 * wide - 0.16) / 3, 0.28, 0.6))
    h = round(min(w * 1.3, (free - 0.08 * (rows - 1)) / rows), 2)
    if h < 0.3:
        return False
    size, low = np.array([round(w, 2), h, 0.03]), max(host.top + OVER, LOWEST if rows == 1 else 0.0)
    steps = product(range(rows), (-1, 0, 1))
    places = [(along + column * (float(size[0]) + 0.08), low + row * (h + 0.08)) for row, column in steps]
    return hung_together(setting, wall, size, places, int(rng.integers(1 << 30)), host.name)


def hung_together(
    setting: Setting, wall: Wall, size: np.ndarray, places: Sequence[tuple[float, float]], variant: int, on: str = ""
) -> bool:
    """Hang pictures of one kind and size at places (along and low) of a wall; all of them or none."""
    kinds = shown(setting, size, len(places), on or f"wall {wall.edge}")
    every = zip(kinds, places, strict=True)
    row = [hung_at(setting, wall, along, kind, size, low, variant, on) for kind, (along, low) in every]
    setting.placed += [one for one in row if one is not None and None not in row]
    return None not in row


def behind(size: np.ndarray, position: np.ndarray, yaw: float, walls: list[Wall]) -> tuple[Wall, float] | None:
    """The wall at the back of a box and where along it its middle is."""
    front = axes(yaw)[1]
    back = position[[0, 2]] - front * size[2] / 2
    for wall in walls:
        along = float((back - wall.start) @ wall.along)
        off = float((back - wall.start) @ wall.inside)
        if front @ wall.inside > 0.97 and -0.1 < off < NEAR and 0 < along < wall.length:
            return wall, along
    return None


def _over(host: Standing, setting: Setting, rng: np.random.Generator) -> list[tuple[str, np.ndarray]]:
    """What would look good over an object, best first."""
    wide = float(host.size[0])
    out: list[tuple[str, np.ndarray]] = []
    if "mirror" in host.row.invites and not any("mirror" in part.slots for part in host.geometry.parts):
        mirror = "round_mirror" if rng.random() < 0.5 else "mirror"
        out.append((mirror, usual_size(mirror, rng)))
    share = rng.uniform(0.6, 0.75)  # two thirds of what it hangs over
    w = float(np.clip(wide * share, 0.35, 1.5))
    ratio = rng.uniform(0.6, 0.72) if w > 0.55 else rng.uniform(1.25, 1.4)
    for scale in (1.0, 0.85, 0.7, 0.55):
        size = np.round([w * scale, w * ratio * scale, 0.03], 2)
        if size[0] >= 0.28:
            out.append(("picture", size))
    return out


def hung_at(
    setting: Setting, wall: Wall, along: float, kind: str, size: np.ndarray, low: float, variant: int, on: str = "",
    *, above: float = 0.0, before: float = 0.2,
) -> Thing | None:  # fmt: skip
    """A thing whose lower side is at `low`; None where an opening, furniture or something else is in its way.

    `above`, `before`: metres that stay free over it and before it.
    """
    half, high, deep = float(size[0]) / 2, low + float(size[1]) + above, float(size[2])
    if min(along, wall.length - along) < half + 0.1 or high > setting.height - 0.05:
        return None
    for opening in (o for o in setting.openings if o.edge == wall.edge):
        if meets(opening, along, half + (SIDE if opening.kind == "window" else 0.12), low, high):
            return None
    room = np.array([2 * half + 0.1, high - low + 0.1, deep + before])
    free = Thing(kind, room, wall.at(along, room[2] / 2 + 0.012, max(low - 0.1, 0.002)), wall.yaw, on)
    hung = Thing(
        kind, size, wall.at(along, deep / 2 + 0.002 - (NICHE if kind == "niche" else 0.0), low), wall.yaw, on, variant
    )
    return hung if setting.clear(free, margin=0.0, floor=False, host=on) else None


def meets(opening: Opening, along: float, half: float, low: float, high: float) -> bool:
    """Whether an opening lies within `half` metres of a place along its wall, between two heights."""
    beside = opening.end < along - half or opening.offset > along + half
    return not beside and opening.sill - 0.1 < high and opening.sill + opening.height + 0.2 > low


SHARES = (0.3, 0.7, 0.5, 0.18, 0.82)  # of a wall's length: aside first, so that a picture has room beside it
SHELF, LOW = 1.38, 0.85  # metres from the floor to the board of a wall shelf, and to a niche
WALL_SHELVES = ("wall_shelf", "ledge", "box_shelf", "niche")  # without a style; of a room both are alike
ABOVE, STANDING = 0.3, 0.6  # metres that stay free over a shelf, and before a mirror in which one sees all of oneself
# Shares of rooms with a clock, of those where people sit together or work; with shelves, coats, a tall mirror; of the
# pieces with a picture above them, those that have three.
CLOCKS, WITH_SHELVES, COATS, MIRRORS, GROUPS = 0.4, 0.5, 0.3, 0.6, 0.5


def shelves(setting: Setting) -> None:
    """Up to two shelves on walls that have room, or niches in them, with books and small things, where it is dry."""
    done, rng = 0, setting.rng("shelves")
    if setting.use or not (setting.walls and setting.has(WITH_SHELVES, rng)):
        return
    kinds = [
        kind for kind in (setting.style.shelves if setting.style else WALL_SHELVES) if setting.own or kind != "niche"
    ]
    kind, variant = str(rng.choice(kinds)), int(rng.integers(1 << 30))
    for wall in _roomiest(setting):
        size = usual_size(kind, setting.rng(f"wall {wall.edge}", "shelf"))
        one, spots = Thing(kind, size, np.zeros(3), 0.0, "", variant), [(wall, share) for share in SHARES]
        board = _hung(setting, one, spots, max(SHELF - float(size[1]), LOW), above=ABOVE)
        if board:
            solids, name = solids_of(kind, size, np.random.default_rng(variant)), f"wall shelf {wall.edge}"
            made = assembled(solids, size, faces=1200, origin=Origin("dressing"))
            carrier = setting.carriers[name] = standing(name, "shelf", size, board.position, board.yaw, made)
            levels = surfaces(carrier)
            for level in levels[1:] if kind == "niche" else [max(levels, key=lambda level: level.area.area)]:
                stocked(setting, carrier, level)
            done += 1
        if done == 2:
            return


def clock(setting: Setting) -> None:
    """A clock on a wall where people sit together or work."""
    rng = setting.rng("wall clock")
    if setting.walls and setting.inviting("clock") and setting.has(CLOCKS, rng):
        _hung(setting, _new("wall_clock", rng), product(_roomiest(setting), SHARES), 1.72)


def coats(setting: Setting) -> None:
    """A rail with a coat and a bag beside a door."""
    for wall in walls_of(setting.floor) if setting.walls and setting.has(COATS, setting.rng("coats")) else ():
        for door in (o for o in setting.openings if o.kind == "door" and o.edge == wall.edge):
            one = _new("coats", setting.rng(door.name, "coats"))
            half = float(one.size[0]) / 2 + 0.12
            spots = [(wall, along / wall.length) for along in (door.end + half, door.offset - half)]
            if _hung(setting, one, spots, 1.78 - float(one.size[1])):
                return


HUNG_OVER = {"coat_rack": "hung_coats", "towel_radiator": "towel"}  # a row's `top` -> what hangs from it


def hung_up(setting: Setting) -> None:
    """Coats side by side on a rack, towels over the rungs of a radiator; none in a block, which has neither."""
    for host in setting.of("storage"):
        kind, corners = HUNG_OVER.get(host.row.top, ""), host.geometry.mesh.vertices
        if not kind or not (abs(corners[:, 1] / float(host.size[1]) - 0.5) < 0.49).any():
            continue
        rng = setting.rng(host.name, kind)
        size = usual_size(kind, rng)
        w, h, d = (float(side) for side in host.size)
        if kind == "hung_coats":
            pegs = (corners[:, 1] > 0.6 * h) & (corners[:, 2] > 0.05 - d / 2) & (abs(corners[:, 0]) < w / 2 - 0.06)
            hooks = min([1.7, 0.9 * h, *corners[pegs, 1] - 0.005])
            seat = corners[corners[:, 1] < h / 2, 1].max()  # of a bench or a board for shoes
            size[1] = min(size[1], hooks - seat - 0.02)
            count, high = max(1, int((w - 0.04) / size[0])), hooks - float(size[1])
            if ((corners[:, 1] > 0.6 * h) & (corners[:, 2] < -0.4 * d)).any():  # a panel, else a rail on posts
                z = -d / 2 + 0.03 + float(size[2]) / 2
            else:
                size[2], z = max(size[2], d - 0.16), 0.0
        else:
            size[0] = min(size[0], w - 0.1)
            count, high, z = 1, 0.86 * h - float(size[1]), d / 2 - 0.02
        for k in range(count):
            place = host.to_room(np.array([[(k - (count - 1) / 2) * w / count, high, z]]))
            one = Thing(kind, size, place[0], host.yaw, host.name, int(rng.integers(1 << 30)))
            if kind == "towel" or k == 0 or rng.random() < 0.7:
                setting.placed.append(one)


def tall_mirror(setting: Setting) -> None:
    """A mirror for the whole person where somebody dresses and can stand before it: in rooms with a wardrobe or bed."""
    rng = setting.rng("tall mirror")
    if setting.walls and setting.inviting("tall_mirror") and setting.has(MIRRORS, rng):
        spots = product(_roomiest(setting), (0.18, 0.82, *SHARES))
        _hung(setting, _new("tall_mirror", rng), spots, 0.3, before=STANDING)


def _new(kind: str, rng: np.random.Generator) -> Thing:
    """A thing of a usual size that has no place yet."""
    return Thing(kind, usual_size(kind, rng), np.zeros(3), 0.0, "", int(rng.integers(1 << 30)))


def _roomiest(setting: Setting) -> Iterable[Wall]:
    """Walls, those with the least hung and the fewest openings first."""

    def used(wall: Wall) -> float:
        here = sum(o.width for o in setting.openings if o.edge == wall.edge)
        for thing in setting.placed:
            off = (thing.position[[0, 2]] - wall.start) @ wall.inside
            along = (thing.position[[0, 2]] - wall.start) @ wall.along
            if thing.position[1] > 0.5 and abs(off) < 0.3 and 0 < along < wall.length:
                here += float(thing.size[0])
        return here - wall.length

    return sorted(walls_of(setting.floor), key=lambda wall: (round(used(wall), 6), wall.edge))


def _hung(setting: Setting, one: Thing, spots: Iterable[tuple[Wall, float]], low: float, **free: float) -> Thing | None:
    """Hang a thing at the first of some shares of walls' lengths where it fits; None where none is."""
    for wall, share in spots:
        at, room, size = share * wall.length, {"above": 0.02, "before": 0.02} | free, one.size.tolist()
        if found := hung_at(setting, wall, at, one.kind, one.size, low, one.variant, "", **room):
            setting.placed.append(found)
            if one.kind == "niche":
                setting.cuts.append(Opening("niche", "window", wall.edge, at - size[0] / 2, size[0], size[1], low))
            return found
    return None
