"""Upholstery: filled cushions and firm bodies in cloth, what one sits on and leans against, with the seams of both."""

from dataclasses import dataclass, replace

import numpy as np

from echomodel.furniture.carpentry import between
from echomodel.furniture.cloth import outward
from echomodel.furniture.solids import FINEST, IDENTITY, Array, Block, Solid, Vector, loft, superellipse, tube
from echomodel.furniture.style import Style

# Role of a cushion -> of its crown: how deep it is dented where one sits or leans, and how else its face is uneven.
GIVES = {"seat": (0.3, 0.14), "back": (0.1, 0.3), "": (0.0, 0.2)}  # others are firm
DRAWN = 0.033  # metres that corners are drawn in at most
SHARES = (0.85, 0.6, 0.35, 0.15)  # of the way from a cushion's edge to its middle, where it has points
# Metres that cloth is drawn in at a seam, and along it to where it is not; radius of a cord that is sewn in.
SEWN, BESIDE, CORD = 0.006, 0.007, 0.0058


@dataclass(frozen=True, eq=False)
class Pad(Block):
    """A filled cushion: its face stands out in its middle by `crown` metres over a seam that runs around it; below that
    is a band, which stands out less, and behind it is flat. It is dented where one sits or leans, and else by where it
    stands, so that no two in a row are alike. Its outline is a superellipse of `power`.
    """

    soft = True
    gives: tuple[float, float] = (0.035, 0.25)
    crown: float = 0.02
    power: float = np.inf

    def _rings(self, detail: int, corners: int) -> Array:
        """(k, corners, 3): loops around its face, from within to its border, and down its sides."""
        thin, r = int(np.argmin(self.half)), min(self.radius, *(self.half * 0.999))
        tall, wide, bulge = self.half[thin], np.roll(self.half, -thin)[1:], 0.14 * self.crown
        # metres within its border, and below its face: over its edge, in its seam, below that, down its side
        edge = [(r, 0), (0.15 * r, 0.48 * r), (SEWN, 0.5 * r + BESIDE), (0, 0.5 * r + 2 * BESIDE)]
        edge += [(-bulge, 0.25 * r + BESIDE + tall), (0.06 * r + bulge, 2 * tall)]
        face, rows = (((0.6,), "0125"), ((0.8, 0.4), "0125"), ((0.8, 0.5, 0.2), "01245"), (SHARES, "012345"))[detail]
        inside, down = np.array(
            [*((r + share * (min(wide) - r), 0) for share in face), *(edge[int(n)] for n in rows)]
        ).T
        outline = superellipse(min(self.power, max(wide) / max(min(1.1 * self.crown, DRAWN), 1e-3)), corners)
        side = outline * (wide - bulge - inside[:, None, None])
        u, v = np.moveaxis(side / wide, -1, 0)
        low = v + 0.3 * (1 - v**2) if self.role == "back" else v  # its filling has settled
        dome = (1 - np.abs(u) ** 2.6) * (1 - np.abs(low) ** 2.6)
        phase = 9.0 * float(self.centre @ (1.0, 0.7, 1.3))
        sat, uneven = GIVES.get(self.role, GIVES[""])
        dent = sat * np.exp(-4 * (u**2 + (v - 0.15) ** 2)) - uneven * np.sin(2.6 * u + phase) * np.cos(2.2 * v + phase)
        lower = self.crown * (1 - dome * (1 - dent)) * np.clip(1 - down / (2 * tall), 0, 1)[:, None]
        high = np.maximum(tall - down[:, None] - lower, -tall)
        front = -float(np.sign(self.centre[0]) or 1.0) if thin == 0 else 1.0  # an arm's face looks towards the seat
        return np.roll(np.stack([front * high, *np.moveaxis(side, -1, 0)], -1), thin, -1)

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        vertices, faces = loft(self._rings(detail, (12, 16, 24, 32)[detail]))
        return vertices, outward(vertices, faces)

    def seam(self) -> Array:
        return np.asarray(self._rings(0, 20)[3])


@dataclass(frozen=True, eq=False)
class Wrapped(Block):
    """A firm body in cloth, upright and long on z, with a panel sewn in at both ends; its top is as round as `head`
    metres and `power` have it, below that it is a share of `stem` as wide.
    """

    soft = True
    material: str = "fabric"
    role: str = "arm"
    stem: float = 1.0
    head: float = 0.05
    power: float = 4.0

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        (wide, tall, deep), high = self.half, self.half[1] - self.head
        below = np.arccos(self.stem ** (self.power / 2))  # radians that its top goes on below
        turn = np.linspace(-below, np.pi + below, (5, 9, 13, 17)[detail])
        over = np.stack([np.cos(turn), np.sin(turn)], 1)
        over = np.sign(over) * np.abs(over) ** (2 / self.power) * (wide, self.head) + (0, high)
        foot = self.stem * wide
        side = np.array([[foot, -tall], [foot + 0.006 * (self.stem < 1), (over[0, 1] - tall) / 2]])
        x, y = np.concatenate([side, over, side[::-1] * (-1, 1)]).T
        # how far behind its ends it is how far drawn in
        edge = [(0.0, 0.01), (0.012, 0.0)] if detail < 2 else [(0.0, 0.01), (0.004, 0.0), (0.012, SEWN), (0.018, 0.0)]
        (back, inward), middle = np.array(edge).T, np.linspace(-0.6, 0.6, (0, 2, 3, 4)[detail]) * deep
        z = np.concatenate([back - deep, middle, (deep - back)[::-1]])[:, None]
        inward = np.concatenate([inward, 0 * middle, inward[::-1]])[:, None]
        return loft(np.stack(np.broadcast_arrays(x * (1 - inward / wide), y - inward * (y + tall) / (2 * tall), z), -1))

    def seam(self) -> Array:
        return self.local_mesh(0)[0][:-2].reshape(4, -1, 3)[2]


def corded(style: Style, *bodies: Pad | Wrapped) -> list[Solid]:
    """Cords, paler than their cloth, in the seams of what is not too thin for them, where the style has piping."""
    lines = [of.seam() @ of.turn.T + of.centre for of in bodies if style.piping > 0.3 and min(of.half[:2]) > 0.03]
    return [tube([*line, line[0]], CORD, "cushion", "seam") for line in lines]


def cushion(
    low: Vector, high: Vector, style: Style, material: str = "fabric", turn: Array = IDENTITY, role: str = "seat",
    power: float = np.inf,
) -> Pad:  # fmt: skip
    """A cushion between two corners, the fuller and the rounder the softer the style is."""
    fuller = ((0.24, 0.16), (0.16, 0.36)) if role == "seat" else ((0.2, 0.1), (0.25, 0.25))
    made = between(Pad, low, high, material=material, turn=turn, role=role, power=power)
    radius, crown = (float(made.half.min() * (least + more * style.softness)) for least, more in fuller)
    return replace(made, radius=radius, crown=crown)
