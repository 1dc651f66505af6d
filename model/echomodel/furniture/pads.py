"""Upholstery: filled cushions and firm bodies in cloth, what one sits on and leans against, with the seams of both."""

from dataclasses import dataclass, replace

import numpy as np

from echomodel.furniture.carpentry import between
from echomodel.furniture.cloth import beyond, closed, grid
from echomodel.furniture.solids import FINEST, IDENTITY, Array, Block, Solid, Vector, loft, tube
from echomodel.furniture.style import Style

# Role of a cushion -> of its crown: how deep it is dented where one sits or leans, and how else its face is uneven.
GIVES = {"seat": (0.42, 0.14), "back": (0.15, 0.3), "": (0.0, 0.2)}  # others are firm
SAT, FULL = 0.62, 0.025  # metres of a seat for one person; of a crown from which on it is dented so
FRONT = 0.02  # metres that a seat's front is fuller in its middle than at its seams, at most
LEVEL = 0.35  # of a crown that its edges are high amid a side, over the corners
DRAWN = 0.018  # metres that corners are drawn in at most
CELLS = (0.45, 0.22, 0.13, 0.1)  # metres between points of a face, by detail
# Metres that cloth is drawn in at a seam, and along it to where it is not; radius of a cord that is sewn in.
SEWN, BESIDE, CORD = 0.006, 0.007, 0.0058


@dataclass(frozen=True, eq=False)
class Pad(Block):
    """A filled cushion: its face stands out in its middle by `crown` metres over a seam that runs around it; below that
    is a band, which stands out less, and behind it is flat. Corners are drawn in and hang. It is dented where people
    sit or lean, and else by where it stands, so that no two in a row are alike. Its outline is a superellipse where it
    has a `power`.
    """

    soft = True
    gives: tuple[float, float] = (0.035, 0.25)
    crown: float = 0.02
    power: float = np.inf

    def _cloth(self, detail: int) -> Array:
        """(n, m, 3): rows and columns of points over its face and down its sides."""
        thin = int(np.argmin(self.half))
        across, along = ((2, 1), (0, 2), (0, 1))[thin]
        tall, r, bulge = self.half[thin], min(self.radius, *(self.half * 0.999)), 0.14 * self.crown
        wide, full = self.half[[across, along]] - bulge, min(self.crown, FRONT) * (self.role == "seat" and thin == 1)
        # metres without its flat face, below it, share of its fullness: over its edge, in its seam, below, down it
        edge = [(0, 0, 0), (0.85 * r, 0.48 * r, 0.1), (r - SEWN, 0.5 * r + BESIDE, 0.2), (r, 0.5 * r + 2 * BESIDE, 0.3)]
        edge += [(r + bulge, 0.25 * r + BESIDE + tall, 1), (0.9 * r - bulge, 2 * tall, 0.2)]
        out, down, ahead = np.array([edge[int(n)] for n in ("0125", "0125", "01245", "012345")[detail]]).T
        rings, lines = np.arange(1, len(out)), []
        for half in wide - r:
            flat = np.linspace(-half, half, int(np.clip(round(2 * half / CELLS[detail]), 2, 14)) + 1)
            lines.append(np.concatenate([-half - rings[::-1], flat, half + rings]))
        inner, away, ring, _ = beyond(lines, wide - r)
        out, down, ahead = (line[ring.round().astype(int)] for line in (out, down, ahead))
        u, v = places = (inner + away * out) / wide[:, None, None]
        if np.isfinite(self.power):
            far = abs(places)
            u, v = places * far.max(0) / np.maximum((far**self.power).sum(0), 1e-9) ** (1 / self.power)
        else:
            drawn = min(1.3 * self.crown, DRAWN) / wide
            u, v = u * (1 - drawn[0] * v**6), v * (1 - drawn[1] * u**6)
        low = v + 0.3 * (1 - v**2) if self.role == "back" else v  # its filling has settled
        phase = 9.0 * float(self.centre @ (1.0, 0.7, 1.3))
        sat, uneven = GIVES.get(self.role, GIVES[""])
        dent, seats = -uneven * np.sin(2.6 * u + phase) * np.cos(2.2 * v + phase), max(1, round(2 * wide[0] / SAT))
        for n, at in enumerate((np.arange(seats) + 0.5) / seats * 2 - 1):
            near = ((u - at) * wide[0] / 0.19) ** 2 + (v * wide[1] / 0.21 + 0.15) ** 2
            dent += sat * min(1.0, self.crown / FULL) * (1 + 0.4 * np.sin(phase + 2.4 * n)) * np.exp(-near)
        dome = np.clip((1 - abs(u) ** 3) * (1 - abs(low) ** 3), 0, 1)
        high = LEVEL * (1 - np.clip(u * v, -1, 1) ** 4) + (1 - LEVEL) * dome * (1 - dent)
        lower = down + self.crown * (1 - high) * np.clip(1 - down / (2 * tall), 0, 1)
        front = -float(np.sign(self.centre[0]) or 1.0) if thin == 0 else 1.0  # an arm's face looks towards the seat
        points = np.empty((*u.shape, 3))
        points[..., thin], points[..., across], points[..., along] = front * (tall - lower), u * wide[0], v * wide[1]
        points[..., along] += full * (ahead * (v > 0) * (1 - u**4) - 0.5 * (1 + v))
        return points

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        points = self._cloth(detail)
        faces, border = grid(*points.shape[:2])
        return closed(points, faces, border, points.reshape(-1, 3)[border].mean(0))

    def seam(self) -> Array:
        sewn = self._cloth(2)[2:-2, 2:-2]
        return sewn.reshape(-1, 3)[grid(*sewn.shape[:2])[1]]


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
        return self.local_mesh(2)[0][:-2].reshape(11, -1, 3)[-2]


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
