"""What is screwed to the walls of a full room beside its pictures: shelves with what stands on them, a clock, coats."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from echomodel.dressing import thing as solids_of
from echomodel.dressing import usual_size
from echousd.dressing.setting import Setting, Standing, Thing, standing
from echousd.dressing.surfaces import surfaces
from echousd.dressing.tabletops import shelved_books
from echousd.dressing.walls import SIDE, Wall, meets, walls_of
from echousd.shapes.geometry import Geometry
from echousd.shapes.joinery import assembled

SHARES = (0.5, 0.3, 0.7, 0.18, 0.82)  # of a wall's length, the middle first
SHELF = 1.38  # metres from the floor to the board of a wall shelf
ABOVE = 0.3  # metres over a shelf that stay free
ON_SHELF = ("small_plant", "photo", "vase", "candles", "bowl", "clock")


def shelves(setting: Setting) -> None:
    """Up to two shelves on walls that have room, with books and small things on them."""
    if not (setting.full and setting.walls):
        return
    done = 0
    for wall in _roomiest(setting):
        rng = setting.rng(f"wall {wall.edge}", "shelf")
        size, variant = usual_size("wall_shelf", rng), int(rng.integers(4))
        one, spots = Thing("wall_shelf", size, np.zeros(3), 0.0, "", variant), [(wall, share) for share in SHARES]
        board = _hang_first(setting, one, spots, SHELF - float(size[1]), ABOVE)
        if board:
            _filled(setting, board, f"wall shelf {wall.edge}")
            done += 1
        if done == 2:
            return


def _filled(setting: Setting, board: Thing, name: str) -> None:
    """Books and small things on a shelf."""
    rng = setting.rng(name, "filled")
    carrier = standing(name, "shelf", board.size, board.position, board.yaw, _geometry(board))
    setting.carriers[name] = carrier
    for surface in surfaces(carrier)[:1]:
        side = float(rng.choice((-1.0, 1.0)))
        tall = 0.25
        size = np.array([round(float(board.size[0]) * rng.uniform(0.25, 0.4), 3), tall, 0.16])
        row = surface.put(setting, "book_row", [(0.97 * side, 0.3), (-0.97 * side, 0.3)], size=size, word="row")
        if row:
            shelved_books(setting, row, rng)
        for number, kind in enumerate(rng.permutation(ON_SHELF)[:3]):
            places = [(x * side, 0.0) for x in (-0.9, -0.45, 0.0, 0.35)]
            surface.put(setting, str(kind), places, word=str(number))


def _geometry(board: Thing) -> Geometry:
    from echousd.shapes.geometry import Origin

    rng = np.random.default_rng(board.variant)
    return assembled(solids_of(board.kind, board.size, rng), board.size, faces=1200, origin=Origin("dressing"))


def clock(setting: Setting) -> None:
    """A clock on a wall where people sit together or work."""
    if not (setting.full and setting.walls and setting.inviting("clock")):
        return
    rng = setting.rng("wall clock")
    size, variant = usual_size("wall_clock", rng), int(rng.integers(1 << 30))
    spots = [(wall, share) for wall in _roomiest(setting) for share in SHARES]
    _hang_first(setting, Thing("wall_clock", size, np.zeros(3), 0.0, "", variant), spots, 1.72, 0.05)


def coats(setting: Setting) -> None:
    """A rail with a coat and a bag beside a door."""
    if not (setting.full and setting.walls):
        return
    for wall in walls_of(setting):
        for door in (o for o in setting.openings if o.kind == "door" and o.edge == wall.edge):
            rng = setting.rng(door.name, "coats")
            size, variant = usual_size("coats", rng), int(rng.integers(1 << 30))
            half = float(size[0]) / 2 + 0.12
            spots = [(wall, along / wall.length) for along in (door.end + half, door.offset - half)]
            one = Thing("coats", size, np.zeros(3), 0.0, "", variant)
            if _hang_first(setting, one, spots, 1.78 - float(size[1]), 0.02):
                return


HUNG_OVER = {"coat_rack": "coats", "towel_radiator": "towel"}  # a row's `top` -> what hangs from it


def hung_up(setting: Setting) -> None:
    """Coats side by side on a rack, towels over the rungs of a radiator."""
    for host in setting.of("storage"):
        kind = HUNG_OVER.get(host.row.top, "")
        if not kind:
            continue
        rng = setting.rng(host.name, kind)
        size = usual_size(kind, rng)
        w, h, d = (float(side) for side in host.size)
        if kind == "coats":
            corners = host.geometry.mesh.vertices
            pegs = (corners[:, 1] > 0.6 * h) & (corners[:, 2] > 0.05 - d / 2) & (abs(corners[:, 0]) < w / 2 - 0.06)
            hooks = min([1.7, 0.9 * h, *corners[pegs, 1] - 0.005])
            seat = corners[corners[:, 1] < h / 2, 1].max()  # of a bench or a board for shoes
            size[1] = min(size[1], hooks - seat - 0.02)
            count, high = max(1, int((w - 0.04) / size[0])), hooks - float(size[1])
            z = 0.0 if d > 2 * size[2] and _posts(host) else -d / 2 + 0.03 + float(size[2]) / 2
        else:
            size[0] = min(size[0], w - 0.1)
            count, high, z = 1, 0.86 * h - float(size[1]), d / 2 - 0.02
        for k in range(count):
            x = (k - (count - 1) / 2) * w / count
            variant = int(rng.integers(1 << 30))
            place = host.to_room(np.array([[x, high, z]]))[0]
            if kind == "towel" or k == 0 or rng.random() < 0.7:
                setting.placed.append(Thing(kind, size, place, host.yaw, host.name, variant))


def _posts(host: Standing) -> bool:
    """Whether a coat rack is a rail on posts, open behind."""
    box = host.geometry.mesh.vertices
    return not bool(((box[:, 1] > 0.6 * host.size[1]) & (box[:, 2] < -0.4 * host.size[2])).any())


def tall_mirror(setting: Setting) -> None:
    """A mirror for the whole person where somebody dresses: in rooms with a wardrobe or a bed."""
    if not (setting.full and setting.walls and setting.inviting("tall_mirror")):
        return
    rng = setting.rng("tall mirror")
    size, variant = usual_size("tall_mirror", rng), int(rng.integers(1 << 30))
    spots = [(wall, share) for wall in _roomiest(setting) for share in (0.18, 0.82, *SHARES)]
    one = Thing("tall_mirror", size, np.zeros(3), 0.0, "", variant)
    _hang_first(setting, one, spots, 0.3, 0.02, _free_before)


def _free_before(setting: Setting, wall: Wall, mirror: Thing) -> bool:
    """Whether a person can stand before a mirror."""
    along = float((mirror.position[[0, 2]] - wall.start) @ wall.along)
    there = Thing("mirror", np.array([0.5, 1.5, 0.5]), wall.at(along, 0.35, 0.05), wall.yaw)
    return setting.clear(there, margin=0.0)


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

    return sorted(walls_of(setting), key=lambda wall: (round(used(wall), 6), wall.edge))


def _hang_first(
    setting: Setting,
    one: Thing,
    spots: Iterable[tuple[Wall, float]],
    low: float,
    above: float,
    wanted: Callable[[Setting, Wall, Thing], bool] = lambda setting, wall, thing: True,
) -> Thing | None:
    """Hang a thing at the first of some shares of walls' lengths where it fits and is wanted; None where none is."""
    for wall, share in spots:
        found = _hung(setting, wall, share, one, low, above)
        if found and wanted(setting, wall, found):
            setting.placed.append(found)
            return found
    return None


def _hung(setting: Setting, wall: Wall, share: float, thing: Thing, low: float, above: float) -> Thing | None:
    """The thing at a share of a wall's length, its lower side at `low`; None where it does not fit."""
    along, high = share * wall.length, low + float(thing.size[1])
    half = float(thing.size[0]) / 2
    if along - half < 0.1 or along + half > wall.length - 0.1 or high + above > setting.height - 0.05:
        return None
    for opening in (o for o in setting.openings if o.edge == wall.edge):
        beside = SIDE if opening.kind == "window" else 0.1
        if meets(opening, along, half + beside, low, high + above):
            return None
    depth = float(thing.size[2])
    before = Thing(thing.kind, thing.size + np.array([0.08, 0.1 + above, 0.02]),
                   wall.at(along, depth / 2 + 0.012, max(low - 0.1, 0.002)), wall.yaw)  # fmt: skip
    if not setting.clear(before, margin=0.0, floor=False):
        return None
    return Thing(thing.kind, thing.size, wall.at(along, depth / 2 + 0.002, low), wall.yaw, "", thing.variant)
