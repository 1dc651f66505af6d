"""What fills the openings and edges the walls: door frames and leaves, windows, skirting, curtain rails, as meshes.

All in a wall's own frame: u along the wall from its first corner, v up, w outwards from its inner face; metres.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import manifold3d
import numpy as np
import shapely

from echomodel.openings import BOARD, SKIRTING, SLID, Opening
from echomodel.triangles import Mesh, box, joined
from echomodel.vocabulary import vocabulary

WALL, NICHE = 0.15, 0.12  # metres, thickness of walls, and how deep niches are cut into them
CASING, PROUD = 0.06, 0.012  # width of the trim around a door, and how far it stands before the wall
LINING = 0.03
LEAF, OVER, TRACK = 0.04, 0.03, 0.07  # thickness of a leaf; what one that slides covers beside its hole; above it
GAP = 0.004
FRAME, BAR, PANE = 0.055, 0.022, 0.42  # width of a window's frame and of its glazing bars, and about what lies between
FOOT = 0.22  # height of the rail at the foot of a French window
PLATE, REACH = 0.085, 0.12  # side of a switch's plate, and how far beside a door's trim it is
RAIL = (0.12, 0.09, 0.25)  # curtain rail: above the window, before the wall, beyond its sides

WINDOWS = {"plain": 3, "sash": 2, "bars": 2, "transom": 2}
DOORS = {"panelled": 3, "four_panels": 2, "flush": 3, "boarded": 1, "glazed": 2}
SKIRTINGS, CORNICES = (0.06, 0.08, 0.1, 0.14), (0.0, 0.0, 0.06, 0.09)  # heights, metres
BEAM = (0.13, 0.15)  # metres, width and depth of beams
BEAMS, BAYS, DADOS = (*[""] * 11, "beam"), 0.1, ("", "", "boarding", "paint")  # of rooms without a style
DADO = (0.91, 0.95)  # metres: the rail over what covers the foot of walls


@dataclass(frozen=True)
class Millwork:
    """How the doors, windows and mouldings of a room are made."""

    window: str = "plain"  # window, door: words of `WINDOWS` and `DOORS`
    door: str = "panelled"
    skirting: float = 0.08  # skirting, cornice: their heights, metres; 0 = no cornice
    cornice: float = 0.0
    boxed: bool = False  # curtains hang from behind boards, in a fifth of rooms without a style
    bay: bool = False  # the widest window stands out before its wall
    beams: str = ""  # slot of beams below the ceiling, "" = none; cornices are in rooms without them
    dado: str = ""  # slot of what covers all walls up to `DADO`, "" = nothing


PLAIN = Millwork()


def millwork_of(seed: int, style: str | None = None, *, private: bool = False) -> Millwork:
    """The millwork that a seed draws, of what goes with a `style`; a `private` room has no glass in its doors."""
    rng, row = np.random.default_rng([seed, 1931]), vocabulary().known_style(style)
    windows = {kind: WINDOWS[kind] for kind in (row.windows if row else WINDOWS)}
    doors = {kind: DOORS[kind] for kind in (row.doors if row else DOORS) if not (private and kind == "glazed")}
    window, door = (
        str(rng.choice(list(odds), p=np.array(list(odds.values())) / sum(odds.values()))) for odds in (windows, doors)
    )
    skirting, cornice = rng.choice(SKIRTINGS), rng.choice(row.cornices if row else CORNICES)
    boxed, beams = rng.random() < (row.boxed if row else 0.2), str(rng.choice(row.beams if row else BEAMS))
    bay, dado = rng.random() < (row.bays if row else BAYS), str(rng.choice(row.dados if row else DADOS))
    return Millwork(window, door, float(skirting), 0.0 if beams else float(cornice), boxed, bay, beams, dado)


def board(u: tuple[float, float], v: tuple[float, float], w: tuple[float, float]) -> Mesh:
    """A box between two values of each coordinate."""
    return box(*zip(u, v, w, strict=True))


def door_frame(opening: Opening, wall: float = WALL, *, both: bool = True) -> Mesh:
    """Lining of the hole in a wall of this thickness, and the trim around it, on both sides or on the inner one."""
    far = wall + PROUD if both else wall
    start, end, top, boards = opening.offset, opening.end, opening.height, list[Mesh]()
    trims = [(0.0, CASING, w) for w in ((-PROUD, 0.0), (wall, far))[: 1 + both]]
    for inside, outside, w in ((LINING, 0.0, (-PROUD, far)), *trims):
        for u in ((start - outside, start + inside), (end - inside, end + outside)):
            boards.append(board(u, (0, top + outside), w))
        boards.append(board((start + inside, end - inside), (top - inside, top + outside), w))
    return joined(boards)


def door_leaf(opening: Opening, wall: float = WALL, kind: str = "panelled") -> Mesh:
    """The closed leaf, flush with the side that it opens to or sliding before the wall; `kind` of `DOORS`."""
    start, end, low, top, w = leaf_of(opening, wall)
    if kind == "glazed":
        (left, right), (bottom, above) = lights_of(start, end, low, top)
        sides = [board((start, left), (low, top), w), board((right, end), (low, top), w)]
        return joined([*sides, board((left, right), (low, bottom), w), board((left, right), (above, top), w)])
    boards = [board((start, end), (low, top), w)]
    columns = [(start + 0.12, end - 0.12)]
    middle = low + 0.42 * (top - low)
    rows = [(low + 0.14, middle - 0.06), (middle + 0.06, top - 0.12)]
    if kind == "four_panels":
        half = (start + end) / 2
        columns = [(start + 0.11, half - 0.05), (half + 0.05, end - 0.11)]
    elif kind == "boarded":
        edges = np.linspace(start, end, max(round((end - start) / 0.14), 1) + 1)
        columns, rows = [(a + 0.004, b - 0.004) for a, b in pairwise(edges)], [(low, top)]
    for inner in columns if kind != "flush" and end - start > 0.4 else ():
        for panel in (row for row in rows if row[1] - row[0] > 0.2):
            boards += [board(inner, panel, side) for side in ((w[0] - 0.006, w[0]), (w[1], w[1] + 0.006))]
    return joined(boards)


def leaf_of(opening: Opening, wall: float) -> tuple[float, float, float, float, tuple[float, float]]:
    """Where a leaf begins and ends along the wall, above the floor, and through the wall."""
    if opening.swing == "slide":
        return opening.offset - OVER, opening.end + OVER, 0.008, opening.height + OVER, (-SLID, LEAF - SLID)
    w = 0.0 if opening.swing == "in" else wall - LEAF
    start, end = opening.offset + LINING + GAP, opening.end - LINING - GAP
    return start, end, 0.008, opening.height - LINING - GAP, (w, w + LEAF)


def lights_of(start: float, end: float, low: float, top: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Where the glass of a leaf is, along the wall and upwards."""
    return (start + 0.11, end - 0.11), (low + 0.38 * (top - low), top - 0.12)


def light_switch(opening: Opening, hinge_first: bool, length: float) -> Mesh | None:
    """A switch beside a door, where its handle is; None where the wall ends there."""
    beside = CASING + REACH
    at = opening.end + beside if hinge_first else opening.offset - beside
    if not PLATE < at < length - PLATE:
        return None
    half, rocker = PLATE / 2, 0.55 * PLATE / 2
    plates = ((half, (-0.007, 0.0)), (rocker, (-0.01, -0.007)))
    return joined([board((at - r, at + r), (1.05 - r, 1.05 + r), w) for r, w in plates])


def door_handle(opening: Opening, hinge_first: bool, wall: float = WALL) -> Mesh:
    """A lever on both sides of the leaf, away from the hinges; of one that slides a bar, and what it hangs on.

    `hinge_first`: whether its hinges are at the jamb that the wall's first corner is nearer to. `wall`: its thickness,
    metres.
    """
    if opening.swing == "slide":
        start, end, _, top, (w, _) = leaf_of(opening, wall)
        hung = [(x, (top - 0.2, top + TRACK)) for x in (start + 0.15, end - 0.15)]
        every = [*hung, (end - 0.07 if hinge_first else start + 0.07, (0.9, 1.2))]
        return joined([board((x - 0.02, x + 0.02), v, (w - 0.008, w)) for x, v in every])
    at = opening.end - LINING - 0.07 if hinge_first else opening.offset + LINING + 0.07
    toward = -0.11 if hinge_first else 0.11
    w = 0.0 if opening.swing == "in" else wall - LEAF
    level = min(1.03, 0.5 * opening.height)
    boards = []
    for near, far in ((w - 0.05, w), (w + LEAF, w + LEAF + 0.05)):
        lever = (near, near + 0.016) if near < w else (far - 0.016, far)
        boards.append(board((at - 0.009, at + 0.009), (level - 0.009, level + 0.009), (near, far)))
        boards.append(board((min(at, at + toward), max(at, at + toward)), (level - 0.009, level + 0.009), lever))
    return joined(boards)


def slid(opening: Opening, hinge_first: bool, length: float) -> float:
    """Metres along a wall of some length that a leaf slides, below 0 towards its first corner; 0 where it turns."""
    if opening.swing != "slide":
        return 0.0
    beside = opening.offset if hinge_first else length - opening.end
    return max(min(opening.width, beside - OVER), 0.01) * (-1.0 if hinge_first else 1.0)


def window_frame(opening: Opening, kind: str = "plain") -> Mesh:
    """The frame in the middle of the wall, with the bars of its `kind` of `WINDOWS`; a leaf's foot in French ones."""
    w = (0.05, 0.11)
    start, end, low, top = opening.offset, opening.end, opening.sill, opening.sill + opening.height
    inner, height = (start + FRAME, end - FRAME), (low + (FRAME if low else FOOT), top - FRAME)
    boards = [
        board((start, start + FRAME), (low, top), w), board((end - FRAME, end), (low, top), w),
        board(inner, (low, height[0]), w), board(inner, (top - FRAME, top), w),
    ]  # fmt: skip
    across = {"sash": low + 0.5 * opening.height, "transom": low + 0.7 * opening.height}.get(kind)
    if across:
        boards.append(board(inner, (across - FRAME / 2, across + FRAME / 2), w))
    if opening.width > 1.05:
        middle = (start + end) / 2
        boards.append(board((middle - FRAME / 2, middle + FRAME / 2), (height[0], across or height[1]), w))
        if not low:
            boards.append(board((middle - 0.012, middle + 0.012), (0.98, 1.1), (0.02, 0.05)))
    if kind == "bars":
        thin = (0.062, 0.1)
        for lines, upright in ((inner, True), (height, False)):
            count = max(round((lines[1] - lines[0]) / PANE), 2)
            for at in np.linspace(*lines, count + 1)[1:-1]:
                line = (float(at) - BAR / 2, float(at) + BAR / 2)
                boards.append(board(line, height, thin) if upright else board(inner, line, thin))
    return joined(boards)


def window_glass(opening: Opening) -> Mesh:
    """One pane behind the frame."""
    u = (opening.offset + FRAME / 2, opening.end - FRAME / 2)
    return board(u, (opening.sill + FRAME / 2, opening.sill + opening.height - FRAME / 2), (0.078, 0.084))


def window_sill(opening: Opening) -> Mesh:
    """The board below a window, a little into the room."""
    return board((opening.offset - BOARD, opening.end + BOARD), (opening.sill - 0.03, opening.sill), (-0.04, 0.0))


def curtain_rail(opening: Opening, length: float, height: float, *, boxed: bool = False) -> Mesh | None:
    """A rail above a window with two holders, or the box that hides it; None where the ceiling is too near."""
    above, before, beyond = RAIL
    level = opening.sill + opening.height + above
    if level > height - 0.05:
        return None
    start, end = max(opening.offset - beyond, 0.02), min(opening.end + beyond, length - 0.02)
    if boxed:
        (low, high), front = (level - 0.07, level + 0.045), -before - 0.07  # before the folds of what hangs there
        sides = [board((at, at + 0.018), (low, high), (front, 0.0)) for at in (start - 0.018, end)]
        return joined([*sides, board((start - 0.018, end + 0.018), (low, high), (front - 0.018, front))])
    rod = extruded(shapely.Point(-before, level).buffer(0.012, quad_segs=3), end - start)
    rod = Mesh(rod.vertices[:, [2, 1, 0]] + (start, 0, 0), rod.faces[:, ::-1])
    holders = [
        board((at - 0.008, at + 0.008), (level - 0.008, level + 0.008), (-before, 0.0))
        for at in (start + 0.06, end - 0.06)
    ]
    return joined([rod, *holders])


def skirting(openings: Sequence[Opening], length: float, tall: float = 0.08, low: float = 0.0) -> Mesh | None:
    """Boards from one height to another along a wall, but for what is open there; None where nothing is left."""
    here = [o for o in openings if o.sill <= tall and o.sill + o.height > low]
    holes = sorted((o.offset, o.end, CASING if o.kind == "door" else 0.0) for o in here)
    boards, at = [], 0.0
    for start, end, trim in [*holes, (length, length, 0.0)]:
        if start - trim - at > 0.01:
            boards.append(board((at, start - trim), (low, tall), (-SKIRTING, 0.0)))
        at = max(at, end + trim)
    return joined(boards) if boards else None


def upright(plan: np.ndarray, low: float, high: float) -> Mesh:
    """A closed prism over a polygon (k, 2) in the first and third coordinate, between two values of the second."""
    prism = extruded(shapely.Polygon(plan * (1, -1)), high - low)
    return Mesh(prism.vertices[:, [0, 2, 1]] * (1, 1, -1) + (0, low, 0), prism.faces)


def extruded(flat: shapely.Polygon, height: float) -> Mesh:
    """A closed prism above a polygon in x and y, up to z = `height`, metres."""
    whole = shapely.geometry.polygon.orient(flat)
    rings = [np.array(ring.coords)[:-1] for ring in (whole.exterior, *whole.interiors)]
    below, faces = np.concatenate(rings), manifold3d.triangulate(rings).astype(int)
    count, start = len(below), np.cumsum([0, *map(len, rings)])
    this = np.arange(count)
    after = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in pairwise(start)])
    sides = [np.stack([this, after, after + count], 1), np.stack([this, after + count, this + count], 1)]
    points = [np.column_stack([below, np.full(count, at)]) for at in (0.0, height)]
    return Mesh(np.concatenate(points), np.concatenate([faces[:, ::-1], faces + count, *sides]))
