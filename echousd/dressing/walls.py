"""What hangs on walls: curtains, pictures and mirrors; in a full room shelves, a clock and coats, too."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from echomodel.boxes2d import axes
from echomodel.dressing import KINDS, printed, usual
from echomodel.dressing import thing as solids_of
from echomodel.openings import Opening, direction, edge_lengths, inward_normal
from echousd.dressing.setting import Setting, Standing, Thing, rectangle, standing
from echousd.dressing.stories import TABLE, Wish
from echousd.dressing.tabletops import decked, stocked, surfaces
from echousd.shapes.fittings import NICHE, RAIL
from echousd.shapes.geometry import Origin
from echousd.shapes.joinery import assembled

EYE = 1.52  # metres, height of a picture's middle on an empty wall
OVER, SCREEN, LOWEST = 0.2, 0.5, 1.15  # metres between furniture, or desks, and what hangs over it; no mirror is lower
TALLEST, HIGHEST, WIDEST = 1.45, 1.95, 2.2  # metres: what has pictures over it; their middle; all together
MOST, CROWD = 6, (4, 3)  # pictures of one wall; of a room and each of its parts: there are none in groups beyond
NARROWER = (1.0, 0.85, 0.7, 0.55)  # shares of its wished width that what hangs may have
NEAR = 0.45  # metres: furniture whose back is so near to a wall stands at it
SIDE = 0.32  # metres that curtains take beside a window
RADIATORS = ("panel_radiator", "panel_radiator", "flat_radiator", "column_radiator")  # without a style
BELOW, BEHIND = 0.14, 0.03  # metres of air between a window's sill and a radiator, and behind it
PLUGGED = ("bed", "desk", "tv_stand")  # words of what has a socket beside it
CURTAINS = ("curtain", "tied_curtain", "eyelet_curtain", "pleated_curtain", "sheer_curtain")  # of a room all are alike
BLINDS = ("blind", "roman_blind")  # the first where it is wet, or where the style has no other: it is blank
APRON = 0.14  # metres below the sill that others end at
# Of how wide curtains hang, where something is beside one; of a rail, how far in both may hang there, less if short.
BUNCHED, INWARD = (1.0, 0.75, 0.55), (0.0, 0.05, 0.1, 0.15, 0.2)


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
    """A curtain on either side of every window down to the floor, or below its sill where something stands before it; a
    blind in it where there is no room for two, or they would end at the sill."""
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
            full = round(min(0.6, 0.2 + 0.2 * window.width), 3)
            low, high = np.clip((window.offset - beyond, window.end + beyond), 0.02, wall.length - 0.02).tolist()
            feet = (0.015, window.sill - APRON) if window.sill > 0.5 else (0.015,)
            for foot, inward, share in (*product(feet[:1], INWARD, BUNCHED), *product(feet[1:], INWARD[:2], BUNCHED)):
                size = np.array([round(full * share, 3), round(rail - foot + 0.005, 3), 0.085])
                inner = size[0] / 2 + inward * (high - low)
                places = (wall.at(x, before, foot) for x in (low + inner, high - inner))
                sides = [Thing(kind, size, place, wall.yaw, "", variant) for place in places]
                if all(setting.clear(one, margin=0.0, floor=False) for one in sides):  # one alone looks forgotten
                    setting.placed += sides
                    setting.curtained.add(window.name)
                    break
            else:
                _blind(setting, wall, window)


def _styled(setting: Setting, kinds: Sequence[str]) -> Sequence[str]:
    """Those of some curtains that go with the style of a room; all where none is told."""
    return [kind for kind in kinds if kind in setting.style.curtains] if setting.style else kinds


def _blind(setting: Setting, wall: Wall, window: Opening) -> None:
    """A blind, let down over a part of the pane."""
    rng, alike = setting.rng(window.name, "blind"), setting.rng("blinds")
    kinds = BLINDS[:1] if setting.use == "wet" else _styled(setting, BLINDS[1:]) or BLINDS[:1]
    kind, variant = str(alike.choice(kinds)), int(alike.integers(1 << 30))
    tall, thick = round(window.height * float(rng.choice((0.2, 0.3, 0.4))), 3), KINDS[kind].low[2]
    size = np.array([round(window.width - 0.012, 3), tall, thick])
    low = window.sill + window.height - 0.004 - tall
    place = wall.at((window.offset + window.end) / 2, thick / 2 - 0.019, low)
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
    for host in (one for word in PLUGGED for one in setting.of(word)):
        wall, along = behind(host.size, host.position, host.yaw, every) or (None, 0.0)
        if wall is not None:
            ways = [side * (float(host.size[0]) / 2 + off) for off in (0.15, 0.3, 0.6, 0.8) for side in (1, -1)]
            spots = [(wall, (along + way) / wall.length) for way in ways]
            _hung(setting, Thing("socket", size, np.zeros(3), 0.0, "", variant), spots, 0.3)


def pictures(setting: Setting) -> None:
    """Pictures or a mirror over what stands at a wall and is no taller than a person."""
    if not setting.walls or setting.use:
        return
    every = walls_of(setting.floor)
    for host in setting.of("picture", "mirror"):
        wall, along = behind(host.size, host.position, host.yaw, every) or (None, 0.0)
        if wall is None or host.top > TALLEST:
            continue
        rng, least = setting.rng(host.name, "picture"), host.top + (SCREEN if host.row.top == "desk" else OVER)
        boards, one = setting.story.boards if host.row.top == "desk" else ("",), None
        if kind := mirror_over(host, rng) or str(rng.choice(boards)):
            size, variant = usual(kind, rng)
            one = hung_at(setting, wall, along, kind, size, max(least, LOWEST), variant, host.name)
        if one is not None:
            setting.placed.append(one)
        else:
            wide = min(float(host.size[0]) * rng.uniform(0.62, 0.76), WIDEST)  # two thirds of what is below
            arranged(setting, wall, along, wide, rng, least, host.name)


def arranged(
    setting: Setting, wall: Wall, along: float, wide: float, rng: np.random.Generator, least: float = 0.0, on: str = ""
) -> bool:
    """Hang pictures about a place along a wall as a row of `hung` in `stories.toml` says, as wide as wished or less.

    `least`: what they hang above, metres. A room has one group at most of as many as they are; False where none fits.
    """
    met = [one for one in setting.placed if KINDS[one.kind].name == "picture"]
    groups, here = Counter(one.variant for one in met), sum(abs(one.yaw - wall.yaw) < 0.01 for one in met)
    free = min(MOST - here, CROWD[0] + CROWD[1] * setting.parts - len(met))
    rows = [row for row in TABLE["hung"] if (n := len(row["of"])) == 1 or (n <= free and n not in groups.values())]
    order, side, variant = rng.permutation(len(rows)), rng.choice((-1, 1)), int(rng.integers(1 << 30))
    for width, row in product(wide * np.array(NARROWER), (rows[k] for k in order)):
        x, y, w, h = (width * np.array(row["of"], float)).T
        if not row["wide"][0] <= width <= row["wide"][1]:
            continue
        half = float((y + h / 2).max())
        middle = max(EYE, least + half)
        if middle > HIGHEST or middle + half > setting.height - 0.2:
            continue
        sizes = np.round(np.stack([w, h, np.full(len(w), 0.03)], 1), 2)
        places = np.stack([along + side * x, middle + y - sizes[:, 1] / 2], 1)
        kinds = shown(setting, sizes[0], len(sizes), on or f"wall {wall.edge}")
        every = zip(kinds, sizes, places.tolist(), strict=False)
        hung = [hung_at(setting, wall, at, kind, size, low, variant, on) for kind, size, (at, low) in every]
        if found := [one for one in hung if one is not None and None not in hung]:  # all of them or none
            setting.placed += found
            return True
    return False


def shown(setting: Setting, size: np.ndarray, count: int, *words: str) -> list[str]:
    """Pictures of one kind that hang together, for who lives there, new to the room; none where there are too few."""
    hung, rng = {thing.kind for thing in setting.placed}, setting.rng(*words, "shown")
    kinds = list(printed("picture", "wide" if size[0] > size[1] else "tall", setting.resident, setting.style).values())
    series = sorted(kinds, key=lambda names: -(rng.random() ** (1 / len(names))))  # every picture alike often
    new = ([name for name in names if name not in hung] for names in series)
    names = next((names for names in new if len(names) >= count), [])
    return [names[k] for k in rng.permutation(len(names))[:count]]


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


def mirror_over(host: Standing, rng: np.random.Generator) -> str:
    """The kind of mirror that would look good over an object, "" = none."""
    if "mirror" not in host.row.invites or any("mirror" in part.slots for part in host.geometry.parts):
        return ""
    return "round_mirror" if rng.random() < 0.5 else "mirror"


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


# Metres of free wall on which something hangs, alone on its wall or beside something else; more is two.
STRETCH, SECOND, HALL = 0.8, 0.95, 4.4
LEVELS, BESIDE = (1.05, 2.0), 0.1  # metres: heights between which a wall must be free, and air to what is not


def free_walls(setting: Setting, least: float = 0.0) -> list[tuple[float, float, Wall]]:
    """Length and middle (metres along the wall) of all stretches of walls where nothing hangs, stands or opens at eye
    height, the longest first; of a hall's walls halves.

    `least`: length of all, metres; else as a wall has one or several of them.
    """
    low, high = LEVELS
    things = [(o.footprint, o.position[1], o.top, False) for o in setting.objects.values()]
    things += [(way, 0.0, door.height, False) for way, door in setting.ways]
    for one in setting.placed:
        hangs = KINDS[one.kind].fixed and not KINDS[one.kind].yields
        things.append((one.footprint, one.position[1], one.position[1] + one.size[1], hangs))
    things = [one for one in things if one[1] < high and one[2] > low]
    every = [(np.array(plan.exterior.coords)[:-1], hangs) for plan, _, _, hangs in things]
    found: list[tuple[float, float, Wall]] = []
    for wall in walls_of(setting.floor):
        taken, more = [(-1.0, 0.0), (wall.length, wall.length + 1.0)], False
        for corners, hangs in every:
            along, off = (corners - wall.start) @ wall.along, (corners - wall.start) @ wall.inside
            if off.min() < 0.3 and off.max() > -0.2 and along.max() > 0.0 and along.min() < wall.length:
                taken.append((along.min() - BESIDE, along.max() + BESIDE))
                more |= hangs
        here = (o for o in setting.openings if o.edge == wall.edge and o.sill < high and o.sill + o.height > low)
        taken += [(o.offset - 0.15, o.end + 0.15) for o in here]
        ends = np.maximum.accumulate([end for _, end in sorted(taken)]).tolist()
        runs = [(start, end) for (start, _), end in zip(sorted(taken)[1:], ends, strict=False) if start > end]
        long = sorted(((start - end, (start + end) / 2) for start, end in runs), reverse=True)
        kept = [one for n, one in enumerate(long) if one[0] >= (least or (SECOND if n or more else STRETCH))]
        for length, middle in kept:
            parts = 1 if least else 1 + int(length / HALL)
            steps = (np.arange(parts) + 0.5) / parts - 0.5
            found += [(length / parts, middle + step * length, wall) for step in steps.tolist()]
    return sorted(found, key=lambda one: (-round(one[0], 4), one[2].edge, one[1]))


# Metres of free wall: a shelf is aside on a longer one, a clock hangs on one so short, and a tall mirror.
BROAD, CLOCK, MIRROR = 1.7, 0.6, 0.7
DOUBLE, HIGHER = 0.5, 0.28  # share of shelves with another below, and metres between them
SHELF, LOW = 1.38, 0.85  # metres from the floor to the board of a wall shelf, and to a niche
WALL_SHELVES = ("wall_shelf", "ledge", "box_shelf", "niche")  # without a style; of a room both are alike
ABOVE, STANDING = 0.3, 0.6  # metres that stay free over a shelf, and before a mirror in which one sees all of oneself
# Shares of rooms with a clock, of those where people sit together or work; with shelves, coats, a tall mirror.
CLOCKS, WITH_SHELVES, COATS, MIRRORS = 0.4, 0.5, 0.3, 0.6


def shelves(setting: Setting) -> None:
    """Up to two shelves on walls that have room, or niches in them, with books and small things, where it is dry."""
    done, rng = 0, setting.rng("shelves")
    if setting.use or not (setting.walls and setting.has(WITH_SHELVES, rng)):
        return
    kinds = [
        kind for kind in (setting.style.shelves if setting.style else WALL_SHELVES) if setting.own or kind != "niche"
    ]
    size, variant = usual(kind := str(rng.choice(kinds)), rng)
    low, step = max(SHELF - float(size[1]), LOW), float(size[1]) + HIGHER
    one = Thing(kind, size, np.zeros(3), 0.0, "", variant)
    for length, middle, wall in free_walls(setting):
        aside = max(0.0, length / 2 - size[0] / 2 - 0.25) if length > BROAD else 0.0
        spot = (middle + aside * float(rng.choice((-1, 1)))) / wall.length
        lows = (low + 0.1, low + 0.1 - step) if kind != "niche" and rng.random() < DOUBLE else (low,)
        for board in [found for at in lows if (found := _hung(setting, one, [(wall, spot)], at, above=ABOVE))]:
            done += 1
            _carries(setting, board, f"wall shelf {done}")
        if done > 1:
            return


SILLS = 0.97 - 0.06 * np.arange(9)  # shares of a window's width that a deep board may have


def sills(setting: Setting) -> None:
    """A deep board below every window, as wide as furniture and curtains leave it, and what stands on it."""
    kind, rng = "window_sill", setting.rng("sills")
    size, variant = usual(kind, rng)
    for wall in walls_of(setting.floor) if setting.walls and setting.use != "outdoor" else ():
        for window in (o for o in setting.openings if o.kind == "window" and o.edge == wall.edge and o.sill):
            place = wall.at((window.offset + window.end) / 2, float(size[2]) / 2 + 0.001, window.sill + 0.002 - size[1])
            sizes = (np.round([share * window.width, *size[1:]], 3) for share in SILLS)
            boards = (Thing(kind, size, place, wall.yaw, "", variant) for size in sizes)
            if board := setting.put_first(boards, floor=False):
                _carries(setting, board, f"sill {window.name}", setting.story.sills)


def _carries(setting: Setting, board: Thing, name: str, wishes: Sequence[Wish] = ()) -> None:
    """Put things on a board, as wished or as on a shelf."""
    solids = solids_of(board.kind, board.size, np.random.default_rng(board.variant))
    made = assembled(solids, board.size, faces=1200, origin=Origin("dressing"))
    carrier = setting.carriers[name] = standing(name, "shelf", board.size, board.position, board.yaw, made)
    for level in surfaces(carrier)[board.kind == "niche" :]:
        decked(setting, carrier, level, wishes) if wishes else stocked(setting, carrier, level)


def clock(setting: Setting) -> None:
    """A clock on a wall where people sit together or work."""
    rng = setting.rng("wall clock")
    if setting.walls and setting.of("clock") and setting.has(CLOCKS, rng):
        least = sorted(free_walls(setting, CLOCK), key=lambda one: one[0])  # where nothing larger fits, or aside
        ways = [
            (wall, middle + (length > BROAD) * (length / 2 - CLOCK / 2), wall.length) for length, middle, wall in least
        ]
        _hung(setting, _new("wall_clock", rng), [(wall, along / whole) for wall, along, whole in ways], 1.62)


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
        size, _ = usual(kind, rng)
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
    if setting.walls and setting.of("tall_mirror") and setting.has(MIRRORS, rng):
        one = _new("tall_mirror", rng)
        free = [(wall, middle, length / 2 - one.size[0]) for length, middle, wall in free_walls(setting, MIRROR)]
        spots = ((wall, (middle + aside) / wall.length) for wall, middle, way in free for aside in (way, -way, 0.0))
        _hung(setting, one, spots, 0.3, before=STANDING)


def _new(kind: str, rng: np.random.Generator) -> Thing:
    """A thing of a usual size that has no place yet."""
    size, variant = usual(kind, rng)
    return Thing(kind, size, np.zeros(3), 0.0, "", variant)


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
