"""Shadows where things touch the floor: smaller than what few rays, whose noise is smoothed away, tell of light."""

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from echomodel.triangles import outlines
from echousd.draw.scenery import Scenery, between

CELL, AROUND, UP = 0.01, 0.014, 0.9  # metres of floor, and around what stands there; cosine of what lies level
OVER = (0.02, 0.003)  # metres over the floor: of what stands on rugs; of all that stands there, or lies as a rug does
PALE = 3  # power of brightness by which what stands there throws back of the light what it takes
LEFT = 1 - np.tanh(np.linspace(0, 1.5, 256, dtype=np.float32))  # of soft light, by how much stands around


class Contact:
    """How dark a floor is next to what stands on it, in cells: (1, 2 * cells) uint8, that on rugs first."""

    def __init__(self, scenery: Scenery) -> None:
        self.floor = float(scenery.triangles[scenery.largest[0], 0, 1])
        low, high = (each[[0, 2]] for each in scenery.bounds)
        self.low, self.cells = low[:, None], np.ceil((high - low) / CELL).astype(int)
        image, layers = Image.new("L", tuple(self.cells.tolist())), list[np.ndarray]()
        draw = ImageDraw.Draw(image)
        for over in OVER:
            lines, which = outlines(scenery.triangles, self.floor + over)
            dark = 255 * (1 - scenery.planes.luma.take(which) ** PALE)
            for line, fill in zip(((lines - low) / CELL).reshape(-1, 4).tolist(), dark.tolist(), strict=True):
                draw.line(line, fill=int(fill))
            layers.append(np.asarray(image.filter(ImageFilter.GaussianBlur(AROUND / CELL))).reshape(1, -1))
        self.dark = np.concatenate(layers, 1)

    def left(self, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(n,) float32: the share of soft light that is left at points (3, n) with normals."""
        out, high = np.ones(point.shape[1], np.float32), point[1] - self.floor
        some = np.flatnonzero((normal[1] > UP) & (np.abs(high) < OVER[0]))
        x, z = (point[[0, 2]].take(some, 1) - self.low) / (CELL * self.cells[:, None])
        first = self.cells.prod() * (high.take(some) <= OVER[1])
        out[some] = between(self.dark, x, z, (first, *self.cells.tolist()), LEFT)[0]
        return out
