"""Upholstery that is filled: the seats, backs and arms of what one sits on."""

from dataclasses import dataclass

import numpy as np

from echomodel.furniture.cloth import closed, grid
from echomodel.furniture.solids import FINEST, IDENTITY, Array, Block
from echomodel.furniture.style import Style

# Role of a cushion -> of how far its middle stands out: how much it is dented, and how deep it puckers at its seams.
GIVES = {"seat": (0.3, 0.14), "back": (0.45, 0.16), "": (0.3, 0.08)}  # others are firm
PUCKERS = 34.0  # radians a metre, from one to the next
# Shares of a cushion's radius from its face to its side: how far out, and how far behind; the last lies on its back.
OVER, DOWN = np.array([0.0, 0.57, 0.97, 0.8]), np.array([0.0, 0.18, 0.75, np.inf])


@dataclass(frozen=True, eq=False)
class Pad(Block):
    """A filled cushion: every side stands out in its middle by `crown` metres over its edges. Its face is dented and
    puckers at its seams by where it stands, so that no two in a row are alike; behind it is flat.
    """

    soft = True
    crown: float = 0.02

    @property
    def gives(self) -> tuple[float, float]:
        return 0.035, 0.25

    def puffed(self, points: Array) -> Array:
        """Points (n, 3) of the block, as far drawn in as its filling lets them be."""
        place = points / self.half
        share = np.clip(1 - place**2, 0, 1)
        flat = share[:, [1, 2, 0]] * share[:, [2, 0, 1]]  # 1 in the middle of the sides of each axis
        out = points * (1 - np.minimum(self.crown / self.half, 0.2) * (1 - flat))
        thin, phase = int(np.argmin(self.half)), 9.0 * float(self.centre @ (1.0, 0.7, 1.3))
        (u, v), (s, t) = (of[:, [(thin + 1) % 3, (thin + 2) % 3]].T for of in (place, PUCKERS * points + phase))
        dent = np.sin(2.6 * u + phase) * np.cos(2.2 * v + 1.7 * phase)
        puckers = np.sin(s) * np.abs(v) ** 3 + np.sin(t) * np.abs(u) ** 3
        out[:, thin] += self.crown * (np.array(GIVES.get(self.role, GIVES[""])) @ (dent, puckers))
        near = np.clip(0.5 + 0.5 * self.front * place[:, thin], 0, 1)  # 0 behind, where it lies
        out[:, thin] = near * out[:, thin] + (1 - near) * points[:, thin]
        return np.asarray(out)

    @property
    def front(self) -> float:
        """Which way along its thin axis its face looks: an arm's towards the seat."""
        return -float(np.sign(self.centre[0]) or 1.0) if np.argmin(self.half) == 0 else 1.0

    def local_mesh(self, detail: int = FINEST) -> tuple[Array, Array]:
        thin, r, cells = int(np.argmin(self.half)), min(self.radius, *(self.half * 0.999)), (1, 2, 6, 9)[detail]
        half = np.roll(self.half, -thin)  # of its face's normal and of the two sides of its face
        counts = np.maximum(np.rint(cells * (half[1:] / half[:0:-1]) ** 0.5 + 1e-6), 1).astype(int)
        nodes = np.meshgrid(*(np.arange(n + 7) - (n + 6) / 2 for n in counts), indexing="ij")
        (u, i), (v, j) = ((x := np.clip(at, -n / 2, n / 2), at - x) for at, n in zip(nodes, counts, strict=True))
        step = np.maximum(abs(i), abs(j)).astype(int)
        high = self.front * np.maximum(half[0] - r * DOWN[step], -half[0])
        over = r * OVER[step] / np.maximum(np.hypot(i, j), 1)
        a, b = 2 * (half[1:] - r) / counts
        points = np.stack([high, a * u + over * i, b * v + over * j], -1)
        vertices, faces = closed(np.roll(points, thin, -1), *grid(*step.shape), -self.front * half[0] * np.eye(3)[thin])
        return self.puffed(vertices), faces


def cushion(
    low: tuple, high: tuple, style: Style, material: str = "fabric", turn: np.ndarray = IDENTITY, role: str = "seat"
) -> Pad:
    """An upholstered body between two corners: its edges rounded as far as the style is soft, bulging at most."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    half = np.maximum((b - a) / 2, 1e-3)
    fuller = ((0.42, 0.4), (0.06, 0.36) if role == "seat" else (0.16, 0.34))  # what stands on a seat wants it level
    radius, crown = (float(half.min() * (low + more * style.softness)) for low, more in fuller)
    return Pad((a + b) / 2, turn, material, role, half=half, radius=radius, crown=crown)
