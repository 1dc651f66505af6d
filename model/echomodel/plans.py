"""Floors that nobody stated: area from the furniture with the space that its use takes, extents, and an outline."""

from collections.abc import Sequence

import numpy as np

from echomodel.openings import Opening
from echomodel.rooms.floor import cut_rectangle
from echomodel.rooms.statistics import room_type_statistics
from echomodel.sizes import filled_area, footprint, pieces, quantile
from echomodel.vocabulary import Category, vocabulary

FULL = 0.55  # of the floor at most in what is proposed: beyond it nobody can walk
WAY = 0.9  # metres beside the longest piece
# What use takes beside a piece, metres: people pull chairs out by 0.75 m and walk round beds at 0.5 to 0.6 m.
BEDSIDE, FOOT, PULL, KNEES, VIEW, HANDS = 0.5, 0.5, 0.75, 0.5, 2.1, 0.1
BEHIND = 0.4  # metres between chairs that are pulled out and a sideboard
DESK_CHAIR = 0.9  # metres before a desk
SPREAD = 0.12  # of the logarithm of what is more than needed
DOOR_AREA = 1.0  # square metres
SPARSE = 0.8  # share of the floor are filled so at least in nine of ten real rooms
WALLED = 0.58  # share of the walls that furniture can stand at: the rest are doors, low windows and corners
LEAST_CUT_AREA = 14.0  # square metres of a floor that can spare a corner
ARM = 2.4  # metres that each arm of a cut floor is wide at least


def used_area(categories: Sequence[str], sizes: Sequence[Sequence[float] | None]) -> float:
    """Square metres that furniture takes with the space before fronts, around tables and beds, and before screens.

    `categories`, `sizes`: as `footprint`.
    """
    there = pieces(categories, sizes)
    chairs = sum(p.kind.stands == "at" for p in there)
    desks = [p for p in there if p.kind.role == "board" and p.kind.access]
    tables = [p for p in there if _dines(p.kind)]
    screen = any(p.kind.stands == "opposite" or p.kind.role == "screen" for p in there)
    served = max((p for p in there if p.kind.role == "sofa" and p.kind.wall), key=lambda p: p.width, default=None)
    at_table = max(chairs - len(desks), 0) / max(len(tables), 1)
    area = 0.0
    for piece in there:
        kind, width, depth = piece.kind, piece.width, piece.depth
        if kind.role == "bed":
            area += (width + 2 * BEDSIDE) * (depth + FOOT)
        elif _dines(kind):
            ends = PULL if at_table > 4 else HANDS
            area += (width + 2 * ends) * (depth + 2 * (PULL if at_table else HANDS))
        elif kind.role == "sofa":
            area += (width + HANDS) * (depth + (VIEW if piece is served and screen else KNEES))
        elif kind.stands == "head" or kind.stands == "at" or (kind.stands == "before" and served and screen):
            continue  # within what beds, tables and sofas take
        elif kind.role == "seat":
            area += (width + HANDS) * (depth + KNEES)
        else:
            front = DESK_CHAIR if piece in desks and chairs else kind.access
            area += (width + HANDS) * (depth + front)
    return area


def longest_side(categories: Sequence[str], sizes: Sequence[Sequence[float] | None]) -> float:
    """Metres, the longest side of anything that stands on the floor.

    `categories`, `sizes`: as `footprint`.
    """
    return max((max(p.width, p.depth) for p in pieces(categories, sizes)), default=0.0)


def floor_extents(
    room_type: str, categories: Sequence[str], sizes: Sequence[Sequence[float] | None], rng: np.random.Generator, *,
    along_x: float = 0.5, openings: Sequence[Opening] = (),
) -> tuple[float, float]:  # fmt: skip
    """(x, z) extents in metres of a rectangular floor that such a room with this furniture would have.

    As large as such rooms are for what the furniture covers, and never smaller than its use asks for.

    Arguments:
        room_type: of the vocabulary.
        categories, sizes: the furniture, see `footprint`.
        rng: of all randomness.
        along_x: probability that the long side runs along x.
        openings: those that are stated already, in the walls of a rectangle; the walls are made long enough.
    """
    row, statistics = vocabulary().room_type(room_type), room_type_statistics(room_type)
    covered = footprint(categories, sizes)
    usual = covered / row.cover * float(np.exp(0.12 * rng.standard_normal()))
    area = float(np.clip(usual, quantile(statistics.area, -0.9), quantile(statistics.area, 1.3)))
    used = used_area(categories, sizes) / row.used * float(np.exp(SPREAD * abs(rng.standard_normal())))
    there = pieces(categories, sizes)
    most = filled_area([p.width for p in there], [p.depth for p in there]) / SPARSE
    area = max(min(area, most), covered / FULL, used + DOOR_AREA)
    longest = longest_side(categories, sizes)
    least = max(statistics.short[0], WAY + longest / 2, _across(categories, sizes))
    aspect = float(np.clip(row.aspect * np.exp(0.14 * rng.standard_normal()), 1.0, 2.2))
    short = max(float(np.sqrt(area / aspect)), least)
    long = max(area / short, short, longest + 0.1)
    walled = sum(p.width + HANDS for p in there if p.kind.wall or (p.kind.role == "board" and p.kind.access))
    grown = walled / WALLED / (2 * (short + long))
    short, long = (round(side * max(grown, 1.0), 1) for side in (short, long))
    x, z = (long, short) if rng.random() < along_x else (short, long)
    x = max([x, *(o.end for o in openings if o.edge % 2 == 0)])
    return x, max([z, *(o.end for o in openings if o.edge % 2 == 1)])


def floor_outline(
    room_type: str, extents: tuple[float, float], longest: float, rng: np.random.Generator
) -> np.ndarray | None:
    """(6, 2) float, corners (x, z) of an L-shaped floor of the area of a rectangle, metres, or None for the rectangle.

    Arguments:
        room_type: of the vocabulary; halls and large rooms are cut more often.
        extents: (x, z) of the rectangle, metres. longest: side of the longest piece, which has to fit an arm.
        rng: of all randomness.
    """
    area = extents[0] * extents[1]
    wanted = rng.random() < vocabulary().room_type(room_type).cut
    width, depth = (float(share) for share in rng.uniform(0.25, 0.42, 2))
    corner = int(rng.integers(4))
    if not wanted or area < LEAST_CUT_AREA:
        return None
    scale = 1 / np.sqrt(1 - width * depth)
    x, z = (round(float(side * scale), 1) for side in extents)
    cut_x, cut_z = round(width * x, 1), round(depth * z, 1)
    if min(x - cut_x, z - cut_z) < ARM or max(x - cut_x, z - cut_z) < longest + WAY / 2:
        return None
    cuts = [(cut_x, cut_z) if at == corner else (0.0, 0.0) for at in range(4)]
    return np.array(cut_rectangle(x / 2, z / 2, cuts)).round(3)


def _dines(kind: Category) -> bool:
    """Whether people sit round such a table."""
    return kind.role == "board" and not (kind.access or kind.belongs_to or kind.wall)


def _across(categories: Sequence[str], sizes: Sequence[Sequence[float] | None]) -> float:
    """Metres that the short side of the room has at least, so that the deepest group fits between two walls."""
    there = pieces(categories, sizes)
    chairs = sum(p.kind.stands == "at" for p in there)
    at_wall = [p.depth for p in there if p.kind.wall and p.kind.role == "storage" and p.kind.access > 0.35]
    storage = max(at_wall, default=0.0)
    out = 0.0
    for piece in there:
        if piece.kind.role == "bed":
            out = max(out, piece.depth + FOOT + 0.4 * bool(storage))
        elif _dines(piece.kind):
            behind = BEHIND * bool(storage and chairs > 1)
            out = max(out, min(piece.width, piece.depth) + 2 * PULL * (chairs > 1) + storage + behind)
        elif piece.kind.role == "sofa":
            screens = [p.depth for p in there if p.kind.stands == "opposite"]
            out = max(out, piece.depth + (VIEW + screens[0] if screens else 2 * KNEES + storage))
        elif piece.kind.role == "board" and piece.kind.access:
            out = max(out, piece.depth + DESK_CHAIR + storage)
    return out
