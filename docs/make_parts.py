"""docs/parts.png: eight pieces of furniture of every class, nobody's pick, as the shipped weights describe them.

    python docs/make_parts.py

A row a class; every piece stands alone in its graph, in a size drawn as the generator of rooms draws it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from PIL import Image, ImageDraw

from echomodel.boxes import Boxes
from echomodel.data.sheet import thumbnail
from echomodel.echo import EchoModel
from echomodel.furniture import mesh_of, sample_size, solids
from echomodel.furniture.solids import pieces_of
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.objective.sizes import size_range
from echomodel.vocabulary import vocabulary

SHEET = Path(__file__).with_name("parts.png")
EACH, PIXELS, MARGIN = 8, 96, 130
PALETTE = {
    "wood": (181, 137, 94), "accent": (206, 178, 142), "fabric": (122, 143, 160), "metal": (92, 92, 98),
    "glass": (170, 205, 214), "ceramic": (214, 206, 196), "enamel": (244, 243, 239), "worktop": (170, 164, 156),
    "steel": (178, 180, 182), "leaf": (94, 140, 82), "soil": (90, 70, 55), "shade": (240, 230, 200),
    "screen": (40, 44, 54), "cushion": (150, 165, 176), "linen": (232, 226, 214), "blanket": (150, 120, 104),
    "mirror": (196, 214, 222), "book": (150, 90, 78), "stem": (118, 104, 66), "leaf_dark": (58, 104, 64),
    "leaf_young": (136, 176, 96), "leaf_sage": (168, 188, 152),
    "leaf_silver": (146, 168, 140), "fruit": (201, 134, 46), "petal": (240, 223, 213),
    "blanket_striped": (160, 130, 114), "blanket_checked": (160, 130, 114), "linen_striped": (222, 214, 202),
    "spines": (150, 90, 78),
}  # fmt: skip


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
            parts = solids(word, *piece_of(vector), size)
            colours = [
                PALETTE.get(one.solid.material, PALETTE["accent"]) for one in pieces_of(parts, size) for _ in one.faces
            ]
            drawn = thumbnail(mesh_of(parts, size), PIXELS, np.array(colours, float))
            sheet.paste(drawn, (MARGIN + column * PIXELS, row * PIXELS))
    sheet.quantize(256).save(SHEET, optimize=True)


if __name__ == "__main__":
    main()
