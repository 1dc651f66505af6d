"""What furniture made of parts costs: python benchmarks/parts_cost.py

Processor seconds of eight objects (sampled, built, with meshes, colliders and masses), floating-point operations an
object, and what assets weigh on disk, as `generate` writes them.
"""

from __future__ import annotations

import time

import numpy as np
import torch
from torch.utils.flop_counter import FlopCounterMode

from echomodel.boxes import Boxes
from echomodel.echo import EchoModel
from echomodel.furniture import sample_size, solids
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.vocabulary import vocabulary
from echousd.layers import assets
from echousd.shapes.geometry import Geometry, Origin
from echousd.shapes.joinery import assembled
from echousd.shapes.surface import surfaces
from echousd.stage.files import layer_bytes
from echousd.stage.paths import piece_path

ORIGIN = Origin("parts")


def sampled(model: EchoModel, words: list[str], sizes: np.ndarray, seed: int) -> np.ndarray:
    """Descriptions (n, WIDTH) of a scene of these classes, nothing told."""
    numbers = [vocabulary().category_id(word) for word in words]
    boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(len(words), 3), torch.zeros(len(words)))
    generator = torch.Generator().manual_seed(seed)
    return model.sample_furniture(GraphBatch.single(numbers), boxes, generator=generator).float().numpy()


def built(word: str, vector: np.ndarray, size: np.ndarray) -> Geometry:
    """A piece as a room gets it."""
    return assembled(solids(word, *piece_of(vector), size), size, faces=5000, origin=ORIGIN)


def on_disk(geometry: Geometry, word: str) -> int:
    """Bytes of the three files of an asset."""
    total = 0
    for parts, write in ((geometry.parts, assets.geometry_layer), (geometry.coarse, assets.coarse_layer)):
        made = surfaces([(p.mesh, p.slots, p.crease) for p in parts]) if parts else []
        forms = {piece_path("", "one", p.name, p.body): form for p, form in zip(parts, made, strict=True)}
        if write is assets.geometry_layer:
            extents = np.stack([form.extent for form in forms.values()])
            extent = np.stack([extents[:, 0].min(0), extents[:, 1].max(0)])
            layer = assets.component_layer("one", word, extent, geometry, {})
            total += len(layer_bytes(assets.geometry_layer("one", forms, geometry, {}, "oak"), ".usdc"))
            total += len(layer_bytes(layer, ".usda"))
        elif forms:
            total += len(layer_bytes(assets.coarse_layer("one", forms, {}), ".usdc"))
    return total


def main() -> None:
    """Print the figures."""
    torch.set_num_threads(1)
    model, rng = EchoModel.load(None), np.random.default_rng(7)
    words = [category.name for category in vocabulary().categories]
    sampled(model, words[:8], np.stack([sample_size(word, rng) for word in words[:8]]), 0)  # warm
    pieces: list[tuple[str, Geometry]] = []
    spent = []
    for start in range(0, len(words) - 7, 8):
        chosen = rng.permutation(words)[:8].tolist()
        sizes = np.stack([sample_size(word, rng) for word in chosen])
        began = time.process_time()
        told = sampled(model, chosen, sizes, start)
        pieces += [(word, built(word, v, size)) for word, v, size in zip(chosen, told, sizes, strict=True)]
        spent.append(time.process_time() - began)
    print(f"eight objects, processor seconds: {np.median(spent):.2f} in the median, {max(spent):.2f} at most")
    sizes = np.stack([sample_size(word, rng) for word in words[:8]])
    plain = EchoModel(model.model)
    with torch.no_grad(), FlopCounterMode(display=False) as counter:
        sampled(plain, words[:8], sizes, 1)
    print(f"GFLOP an object: {counter.get_total_flops() / 8e9:.3f}")
    weights = [on_disk(geometry, word) for word, geometry in pieces]
    print(f"kB of an asset: {np.median(weights) / 1e3:.0f} in the median, {max(weights) / 1e3:.0f} at most")
    faces = [geometry.faces for _, geometry in pieces]
    print(f"faces: {np.median(faces):.0f} in the median, {max(faces)} at most")
    print(f"meshes: {np.mean([len(geometry.parts) for _, geometry in pieces]):.1f} an asset")
    print(f"second level of detail: {sum(bool(g.coarse) for _, g in pieces)} of {len(pieces)}")


if __name__ == "__main__":
    main()
