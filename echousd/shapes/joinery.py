"""Geometry of furniture that is made of solids: exact meshes in a face budget, convex colliders, mass."""

import warnings
from collections.abc import Sequence

import numpy as np

from echomodel.furniture.solids import FINEST, MeshedSolid, Solid, pieces_of
from echomodel.triangles import Mesh, area_normals, bounds_of, joined, lengths
from echousd.shapes.geometry import DRAPED, FRAME, Collider, Geometry, Mass, Origin, Part
from echousd.shapes.hulls import convex_hull, hull_of
from echousd.shapes.matter import ballasted, weighed

SLOTS = {"accent": "front"}  # material of a solid -> material slot, where they differ
# role of a solid -> name of the part that all of its kind are in, where they differ
GROUPS = {
    "leg": "legs", "rail": "rails", "arm": "arms", "side": "case", "bottom": "case", "shelf": "shelves",
    "handle": "handles", "leaf": "leaves", "book": "books", "bottle": "bottles", "pillow": "pillows",
    "cushion": "cushions", "caster": "casters", "seam": "seams", "cord": "cords", "shade": "shades", "bulb": "bulbs",
}  # fmt: skip
CREASE = np.radians(50.0)  # a rounding of two steps still shades as one
COARSE = 0.7  # share of the faces below which a second level of detail is worth its file
COLLIDERS = 64  # convex pieces of one body at most
SLACK = 0.003  # metres that a mesh may reach beyond its convex pieces
MOST = 0.8  # share of what the worst face lacks, from which on a face gets a corner in the same round
# Levels of detail of what is hard and of what is soft, whose form is its mesh's, from the finest to boxes.
FINENESS = ((FINEST, FINEST), (2, FINEST), (1, FINEST), (1, 2), (1, 1), (0, 1), (0, 0))
SMALL = 0.002  # share of its box below which a solid alone is no obstacle


def assembled(
    solids: Sequence[Solid], size: np.ndarray, *, faces: int, origin: Origin, description: tuple[float, ...] = (),
    round: bool = False,
) -> Geometry:  # fmt: skip
    """The geometry of one piece of furniture: a part for each role (legs, top, back), drawers and doors in bodies.

    `solids`: of a furniture program. `size`: (3,) float, metres; the geometry fills it, in width or in depth alone
    where it is `round`. `faces`: most triangles of all parts together; the finest detail that stays below is taken.
    `origin`: provenance. `description`: what the solids were made from.
    """
    pieces = within_budget(solids, size, faces, round=round)
    used = [piece.solid for piece in pieces]
    plain, low = pieces_of(used, size, 1, round=round), pieces_of(used, size, 0, round=round)
    fixed = FRAME if any(piece.joint for piece in pieces) else ""
    parts: list[Part] = []
    colliders: list[Collider] = []
    masses: dict[str, Mass] = {}
    for body, members in _bodies(pieces, fixed).items():
        prefix = f"{body}_" if body != fixed else ""
        parts += _parts(prefix, members, body)
        own = _bodies(plain, fixed)[body]
        corners = [
            level(each.solid, covering(*run))
            for each, shown in zip(own, members, strict=True)
            for run in zip(each.solid.runs(each.vertices), shown.solid.runs(shown.vertices), strict=True)
        ]
        hulls = convex_pieces(corners, float(np.prod(size)))
        words = [f"{prefix}collider", *(f"{prefix}collider_{n}" for n in range(2, len(hulls) + 1))]
        colliders += [Collider(word, hull, "convexHull", body) for word, hull in zip(words, hulls, strict=True)]
        if fixed:
            masses[body] = weighed(own)
    joints = {piece.joint.body: piece.joint for piece in pieces if piece.joint}
    fewer = sum(len(piece.faces) for piece in low) < COARSE * sum(len(piece.faces) for piece in pieces)
    coarse: list[Part] = []
    for body, members in _bodies(low, fixed).items() if fewer else ():
        coarse += _parts(f"{body}_" if body != fixed else "", members, body)
    whole = ballasted(weighed(plain), [piece.vertices for piece in plain])
    return Geometry(
        tuple(parts), tuple(colliders), origin, mass=whole, joints=tuple(joints.values()),
        masses=masses, coarse=tuple(coarse), description=description,
    )  # fmt: skip


def _bodies(pieces: Sequence[MeshedSolid], fixed: str) -> dict[str, list[MeshedSolid]]:
    """Body -> its solids, what is fixed first."""
    out: dict[str, list[MeshedSolid]] = {fixed: []}
    for piece in pieces:
        out.setdefault(piece.joint.body if piece.joint else fixed, []).append(piece)
    return {body: members for body, members in out.items() if members}


def _parts(prefix: str, pieces: Sequence[MeshedSolid], body: str) -> list[Part]:
    """A part for each role among the solids of a body; what is the body itself, a drawer or a door, is its `mesh`."""
    kind = body.rsplit("_", 1)[0]
    groups: dict[str, list[MeshedSolid]] = {}
    for piece in pieces:
        role = piece.solid.role
        groups.setdefault("mesh" if role == kind else GROUPS.get(role, role), []).append(piece)
    return [part_of(f"{prefix}{role}", members, body) for role, members in groups.items()]


def within_budget(solids: Sequence[Solid], size: np.ndarray, faces: int, *, round: bool = False) -> list[MeshedSolid]:
    """The solids as fine as `faces` triangles allow, soft ones and pots before hard ones; of too many the smallest
    are left out and it warns."""
    soft = np.array([solid.soft or solid.role == "pot" for solid in solids if not solid.core])
    for hard, cloth in FINENESS:
        pieces = pieces_of(solids, size, np.where(soft, cloth, hard), round=round)
        count = np.array([len(piece.faces) for piece in pieces])
        if count.sum() <= faces:
            return pieces
    kept, left = [], faces
    for number in np.argsort([-float(np.prod(np.ptp(piece.vertices, axis=0))) for piece in pieces]).tolist():
        if count[number] <= left:
            kept.append(number)
            left -= count[number]
    warnings.warn(f"{faces} faces are too few: {len(pieces) - len(kept)} small solids are left out", stacklevel=2)
    return pieces_of([pieces[number].solid for number in sorted(kept)], size, 0, round=round)


def part_of(name: str, pieces: Sequence[MeshedSolid], body: str = "") -> Part:
    """Some meshed solids as one part with a slot per material."""
    mesh = joined([Mesh(piece.vertices, piece.faces) for piece in pieces])
    words = [SLOTS.get(piece.solid.material, piece.solid.material) for piece in pieces]
    slot = np.repeat(words, [len(piece.faces) for piece in pieces])
    crease = DRAPED if any(piece.solid.draped for piece in pieces) else CREASE
    return Part(name, mesh, {word: np.flatnonzero(slot == word) for word in sorted(set(words))}, crease, body)


def covering(plain: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Corners of a coarse solid (n, 3), and those of its finer mesh (m, 3) without which that reaches out of their hull
    by more than `SLACK`: a round top of twelve corners lacks a centimetre of what is seen.
    """
    corners, taken = plain, np.zeros(0, int)
    while not np.array_equal(plain, shown) and (hull := hull_of(corners)):
        normal = area_normals(hull.triangles)
        normal /= np.maximum(lengths(normal), 1e-12)[:, None]
        beyond = shown @ normal.T - (hull.triangles[:, 0] * normal).sum(1)
        far = beyond.max(0)
        # the one farthest beyond each face, of faces that lack most: one at a time takes a hull for each
        wanted = np.setdiff1d(beyond[:, far > max(SLACK, MOST * far.max())].argmax(0), taken)
        if not len(wanted):  # where nothing is lacked, or only by a face too narrow for a normal of its own
            break
        corners, taken = np.concatenate([corners, shown[wanted]]), np.concatenate([taken, wanted])
    return corners


def level(solid: Solid, corners: np.ndarray) -> np.ndarray:
    """Corners (n, 3) of what a solid collides with: soft seats are level on top, and covers amid their folds."""
    x, y, z = corners.T
    deep, share = solid.gives
    top = y.max() - min(deep, share * np.ptp(y))
    if solid.role == "seat" and solid.material == "fabric":
        y = np.minimum(y, top)
    elif solid.role == "cover":
        y = np.where(y > top - deep, top, y)
    return np.column_stack([x, y, z])


def convex_pieces(points: Sequence[np.ndarray], box: float) -> list[Mesh]:
    """Convex hulls (each a closed mesh) around solids; a small one joins the one that it wastes the least room with.

    Where all of them would waste more than a small one is, and hulls are few enough, it stays alone: on a wedge from a
    panel to the mirror above it nothing could stand.

    `points`: vertices (n, 3) of each solid, metres. `box`: volume of the whole piece's box, m³; what is far smaller is
    no obstacle of its own.
    """
    groups = list(points)
    low, high = np.array([bounds_of(p) for p in points]).reshape(-1, 2, 3).swapaxes(0, 1)
    while len(groups) > 1:
        volume = _volume(low, high)
        union = _volume(np.minimum(low[:, None], low), np.maximum(high[:, None], high))
        wasted = union - volume - volume[:, None] + np.diag(np.full(len(groups), np.inf))
        if len(groups) <= COLLIDERS:
            small = np.minimum(volume, volume[:, None]) < SMALL * box
            wasted[~small | (wasted > SMALL * box)] = np.inf
        one, other = sorted(map(int, np.unravel_index(np.argmin(wasted), wasted.shape)))
        if np.isinf(wasted[one, other]):
            break
        groups[one] = np.concatenate([groups[one], groups.pop(other)])
        low[one], high[one] = bounds_of(groups[one])
        low, high = np.delete(low, other, axis=0), np.delete(high, other, axis=0)
    return [convex_hull(group) for group in groups]


def _volume(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Volumes of boxes, none thinner than a millimetre."""
    return np.prod(np.maximum(high - low, 1e-3), axis=-1)
