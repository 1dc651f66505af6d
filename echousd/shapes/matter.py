"""What solids weigh: boards, tubes and shells by what they are made of, thick ones hollow as real ones are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from echomodel.dressing.household import PICTURES
from echomodel.dressing.textiles import RUGS
from echomodel.furniture.assembly import Piece
from echomodel.triangles import cross
from echousd.shapes.geometry import Mass
from echousd.shapes.masses import LEAST_INERTIA


@dataclass(frozen=True)
class Matter:
    """What a solid stands for.

    Arguments:
        density: of what it is made of, kg/m³.
        wall: how thick that is at most, metres: a tube, a shade, a frame with two boards. What is thinner than twice as
            much is massive.
        core: density of what a wall encloses, kg/m³.
    """

    density: float
    wall: float = np.inf
    core: float = 0.0


WOOD = Matter(620.0, 0.010)  # particle board and timber; boards of more than about 2 cm are frames with a skin
STEEL = Matter(7850.0, 0.0015)
FOAM = Matter(220.0, 0.010, core=45.0)  # upholstery: cloth, webbing and a light frame about the foam
# Material of a solid -> what it stands for.
MATTER: Mapping[str, Matter] = {
    "wood": WOOD, "accent": WOOD, "frame": WOOD, "metal": STEEL, "steel": STEEL, "glass": Matter(2500.0, 0.004),
    "mirror": Matter(2500.0, 0.003), "ceramic": Matter(2200.0, 0.005),
    "enamel": Matter(2200.0, 0.005), "worktop": Matter(2400.0, 0.006), "shade": Matter(1200.0, 0.0012),
    "screen": Matter(1500.0, 0.0015), "fabric": FOAM, "cushion": Matter(40.0), "linen": Matter(50.0),
    "blanket": Matter(20.0), "accent_cloth": Matter(40.0), "accent_plain": Matter(40.0), "leather": Matter(300.0),
    "wicker": Matter(400.0, 0.006), "leaf": Matter(120.0), "petal": Matter(120.0), "stem": Matter(500.0),
    "soil": Matter(900.0), "fruit": Matter(800.0), "wax": Matter(900.0), "paper": Matter(700.0),
    "book": Matter(650.0), "book_a": Matter(650.0), "book_b": Matter(650.0), "book_c": Matter(650.0),
    "book_d": Matter(650.0), "curtain": Matter(120.0), "sheer": Matter(60.0),
    **dict.fromkeys(RUGS, Matter(250.0)), **dict.fromkeys(PICTURES, Matter(300.0)),
}  # fmt: skip
# Role and material of a solid -> what it stands for, where the material alone tells how it looks.
PARTS: Mapping[tuple[str, str], Matter] = {
    ("seat", "fabric"): Matter(380.0, 0.010, core=45.0),  # on springs or a board
    ("rail", "wood"): Matter(620.0, 0.005),  # of a bed: boards about slats
    ("back", "accent"): Matter(800.0, 0.0025),  # of a case
    ("foot", "metal"): Matter(7200.0, 0.003),  # of a lamp: cast
    ("pot", "ceramic"): Matter(2200.0, 0.005, core=400.0),  # half full of damp soil
    ("stone", "ceramic"): Matter(2200.0, 0.015),  # of a mantel: slabs
    ("stove", "screen"): Matter(7200.0, 0.004, core=60.0),  # cast, lined with brick
    ("machine", "enamel"): Matter(7850.0, 0.0008, core=150.0),  # sheet about a drum, a motor and a counterweight
    ("cold", "steel"): Matter(7850.0, 0.0006, core=45.0),  # sheet about foam, shelves and a compressor
    ("cold", "enamel"): Matter(7850.0, 0.0006, core=45.0),
    ("case", "wood"): Matter(620.0, 0.02, core=260.0),  # of a piano: an iron frame, strings and action
    ("case", "screen"): Matter(620.0, 0.02, core=260.0),
    ("housing", "metal"): Matter(3000.0, 0.0015),  # of a screen: sheet and plastic about electronics
}


def weighed(pieces: Iterable[Piece]) -> Mass:
    """Mass, centre and moments of inertia of meshed solids; overlaps count twice."""
    total, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for piece in pieces:
        matter = PARTS.get((piece.solid.role, piece.solid.material)) or MATTER[piece.solid.material]
        volume, area = _moments(piece)
        inside, skin = max(volume[0], 1e-7), max(area[0], 1e-7)
        walls = min(inside, skin * matter.wall)
        massive = walls >= inside
        for kilograms, (measure, one, two) in (
            (matter.density * walls, volume if massive and volume[0] > 0 else area),
            (matter.core * (inside - walls), volume),
        ):
            if kilograms > 0:
                total += kilograms
                first += kilograms / max(measure, 1e-12) * one
                second += kilograms / max(measure, 1e-12) * two
    middle = first / total
    second = second - total * np.outer(middle, middle)
    values, axes = np.linalg.eigh(np.trace(second) * np.eye(3) - second)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return Mass(total, middle, np.maximum(values, LEAST_INERTIA), axes)


Moments = tuple[float, np.ndarray, np.ndarray]


def _moments(piece: Piece) -> tuple[Moments, Moments]:
    """Of the volume and of the surface of a closed mesh: measure, first (3,) and second moment (3, 3) about 0."""
    origin = piece.vertices[0]
    corners = (piece.vertices - origin)[piece.faces]
    one, two, three = corners.transpose(1, 0, 2)
    whole = corners.sum(1)
    pairs = np.einsum("tki,tkj->tij", corners, corners) + whole[:, :, None] * whole[:, None, :]
    six = (one * cross(two, three)).sum(1)
    area = np.linalg.norm(cross(two - one, three - one), axis=1) / 2
    solid = (float(six.sum() / 6), six @ whole / 24, np.einsum("t,tij->ij", six, pairs) / 120)
    surface = (float(area.sum()), area @ whole / 3, np.einsum("t,tij->ij", area, pairs) / 12)
    return _moved(*solid, origin), _moved(*surface, origin)


def _moved(measure: float, first: np.ndarray, second: np.ndarray, by: np.ndarray) -> Moments:
    """Moments about a point that lies `-by` from the one that they are about."""
    mixed = np.outer(first, by)
    return measure, first + measure * by, second + mixed + mixed.T + measure * np.outer(by, by)
