"""docs/parts.png: eight pieces of furniture of every class, nobody's pick, as the shipped weights describe them.

    python docs/make_parts.py

A row a class; every piece stands alone in its graph, in a size drawn as the generator of rooms draws it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
import trimesh
from PIL import Image, ImageDraw

from echomodel.boxes import Boxes
from echomodel.echo import EchoModel
from echomodel.furniture import mesh_of, sample_size, solids
from echomodel.furniture.assembly import MATERIALS
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.objective.sizes import size_range
from echomodel.vocabulary import vocabulary

SHEET = Path(__file__).with_name("parts.png")
EACH, PIXELS, MARGIN = 8, 96, 130
TOWARD, LIGHT = np.array([0.53, 0.34, 0.78]), np.array([-0.34, 0.73, 0.59])  # to the viewer, and to the light
COLOURS = {
    "wood": (181, 137, 94), "accent": (206, 178, 142), "fabric": (122, 143, 160), "metal": (92, 92, 98),
    "glass": (170, 205, 214), "ceramic": (214, 206, 196), "leaf": (94, 140, 82), "soil": (90, 70, 55),
    "shade": (240, 230, 200), "screen": (40, 44, 54), "cushion": (150, 165, 176), "linen": (232, 226, 214),
    "blanket": (150, 120, 104), "mirror": (196, 214, 222), "book": (150, 90, 78), "stem": (118, 104, 66),
    "enamel": (244, 243, 239), "worktop": (170, 164, 156), "steel": (178, 180, 182), "leaf_dark": (66, 112, 66),
    "leaf_silver": (143, 168, 136), "fruit": (201, 134, 46), "petal": (240, 223, 213),
}  # fmt: skip


def picture(mesh: trimesh.Trimesh) -> Image.Image:
    """A mesh from its front right above, point by point."""
    side = 2 * PIXELS
    right = np.cross((0.0, 1.0, 0.0), TOWARD)
    right /= np.linalg.norm(right)
    view = np.stack([right, np.cross(TOWARD, right), TOWARD])
    points, face = trimesh.sample.sample_surface(mesh, 4 * side * side, seed=0)
    corners, seen = mesh.vertices @ view.T, points @ view.T
    low, high = corners.min(0), corners.max(0)
    x, y = ((seen - (low + high) / 2)[:, :2] / (high - low)[:2].max() * 0.9 * side * (1, -1) + side / 2).astype(int).T
    normal = mesh.face_normals * np.where(mesh.face_normals @ TOWARD < 0, -1, 1)[:, None]
    material = np.asarray(mesh.face_attributes["material"], int)
    colour = np.array([COLOURS[word] for word in MATERIALS], float)[material]
    shaded = colour * (0.4 + 0.65 * np.maximum(normal @ LIGHT, 0))[:, None]
    image, order = np.full((side, side, 3), 250.0), np.argsort(seen[:, 2])[:, None]  # what is nearer is drawn later
    image[y[order] + [0, 1, 0, 1], x[order] + [0, 0, 1, 1]] = shaded[face[order]]
    return Image.fromarray(image.clip(0, 255).astype(np.uint8)).resize((PIXELS, PIXELS), Image.Resampling.BOX)


def main() -> None:
    """Draw the sheet."""
    words = [category.name for category in vocabulary().categories]
    sheet = Image.new("RGB", (MARGIN + EACH * PIXELS, len(words) * PIXELS), (250, 250, 250))
    model, rng, generator = EchoModel.load(), np.random.default_rng(2), torch.Generator().manual_seed(0)
    for row, word in enumerate(words):
        ImageDraw.Draw(sheet).text((6, row * PIXELS + PIXELS // 2 - 6), word, fill=(20, 20, 20))
        limits = map(np.array, size_range(word))
        sizes = np.clip([sample_size(word, rng) for _ in range(EACH)], *limits)
        boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(EACH, 3), torch.zeros(EACH))
        graph = GraphBatch.pack([GraphBatch.single([row])] * EACH)
        found = np.asarray(model.sample_furniture(graph, boxes, generator=generator))
        for column, (vector, size) in enumerate(zip(found, sizes, strict=True)):
            mesh = mesh_of(solids(word, *piece_of(vector), size), size)
            sheet.paste(picture(mesh), (MARGIN + column * PIXELS, row * PIXELS))
    sheet.quantize(256).save(SHEET, optimize=True)


if __name__ == "__main__":
    main()
