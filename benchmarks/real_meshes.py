"""Furniture against real meshes, which no weights have seen: does a classifier name it, how near does it come?

    python benchmarks/real_meshes.py INDEX... [--least 8] [--per-class 16] [--seeds 1] [--sdf] [--cache F.npz] [--json]

A classifier of point clouds in metres is trained on the real meshes alone (of an index by `echousd assets index`, of
Sweet Home 3D's libraries for example), then names pieces that the furniture branch described and pieces of the
programs' own styles, of the same sizes. MMD, COV and 1-NNA compare sets of equal size with the real ones, in the unit
box. Of several seeds the mean and the standard deviation are told.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import torch
import trimesh
from torch import Tensor, nn

from echomodel.boxes import Boxes
from echomodel.echo import EchoModel
from echomodel.furniture import draw_choices, draw_style, mesh_of, sample_size, solids
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.metrics.pointsets import set_scores, surface_points
from echomodel.tsdf import mesh_from_tsdf
from echomodel.vocabulary import vocabulary
from echousd.assets.measure import measure
from echousd.assets.table import read_library
from echousd.shapes.originals.loading import library_file

POINTS, WIDTH, STEPS, BATCH, FOLDS, JUDGES = 256, 96, 240, 32, 3, 2


class PointNet(nn.Module):
    """Classes of point clouds (n, p, 3): a perceptron of every point, the largest and the mean of what all say."""

    def __init__(self, classes: int) -> None:
        super().__init__()
        self.each = nn.Sequential(nn.Linear(3, 48), nn.SiLU(), nn.Linear(48, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH))
        self.says = nn.Sequential(nn.Dropout(0.3), nn.Linear(2 * WIDTH, 64), nn.SiLU(), nn.Linear(64, classes))

    def forward(self, points: Tensor) -> Tensor:
        seen = self.each(points)
        return self.says(torch.cat([seen.amax(1), seen.mean(1)], 1))


def trained(points: np.ndarray, label: np.ndarray, classes: int, seed: int) -> PointNet:
    """A classifier, its clouds mirrored, stretched by up to a sixth and moved by millimetres along the way."""
    torch.manual_seed(seed)
    model = PointNet(classes)
    share = np.bincount(label, minlength=classes)
    weight = torch.from_numpy(1.0 / np.maximum(share, 1)).float()
    adam = torch.optim.AdamW(model.parameters(), 3e-3, weight_decay=1e-2)
    plan = torch.optim.lr_scheduler.OneCycleLR(adam, 3e-3, STEPS)
    clouds, words = torch.from_numpy(points).float(), torch.from_numpy(label)
    for _ in range(STEPS):
        rows = torch.multinomial(weight[words], BATCH, replacement=True)
        seen = clouds[rows] * (1 + 0.16 * (2 * torch.rand(BATCH, 1, 3) - 1)) + 0.005 * torch.randn(BATCH, POINTS, 3)
        seen[:, :, 0] *= torch.where(torch.rand(BATCH, 1) < 0.5, -1.0, 1.0)
        loss = nn.functional.cross_entropy(model(seen), words[rows], label_smoothing=0.05)
        adam.zero_grad()
        loss.backward()
        adam.step()
        plan.step()
    return model.eval()


@torch.no_grad()
def named(model: PointNet, points: np.ndarray, label: np.ndarray) -> float:
    """The mean over classes of the share of clouds that are called by their name."""
    right = (model(torch.from_numpy(points).float()).argmax(1).numpy() == label).astype(float)
    return float(np.mean([right[label == word].mean() for word in np.unique(label)]))


def cloud(mesh: trimesh.Trimesh) -> np.ndarray:
    """(POINTS, 3) on the surface in metres, standing on y = 0, centred."""
    low, high = mesh.bounds
    return surface_points(mesh, POINTS) - np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])


def real_clouds(sources: list[Path], cache: Path) -> dict[str, np.ndarray]:
    """Class -> clouds (n, POINTS, 3) of the real meshes."""
    if not cache.exists():
        found: dict[str, list] = {}
        for library in map(read_library, sources):
            for record in (record for record in library.records.values() if record.usable):
                try:
                    mesh = measure(library_file(library, record)).turned(np.eye(3))
                except ValueError as error:
                    print(f"left out: {error}")
                    continue
                found.setdefault(record.category, []).append(cloud(mesh.apply_transform(record.pose())))
        np.savez(cache, **{name: np.stack(clouds) for name, clouds in found.items()})
    return {name: clouds[:, :POINTS] for name, clouds in np.load(cache).items()}


def pieces(model: EchoModel, classes: list[str], count: int, seed: int, *, sdf: bool) -> dict[str, dict[str, list]]:
    """Kind of maker -> class -> meshes of the same sizes: `parts`, `programs` and, where asked for, `sdf`."""
    rng, generator = np.random.default_rng(seed), torch.Generator().manual_seed(seed)
    made: dict[str, dict[str, list]] = {kind: {} for kind in ("parts", "programs", *(["sdf"] if sdf else []))}
    for name in classes:
        sizes = np.stack([sample_size(name, rng) for _ in range(count)])
        graph = GraphBatch.pack([GraphBatch.single([vocabulary().category_id(name)])] * count)
        boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(count, 3), torch.zeros(count))
        told = model.sample_furniture(graph, boxes, generator=generator).numpy()
        made["parts"][name] = [
            mesh_of(solids(name, *piece_of(v), size), size) for v, size in zip(told, sizes, strict=True)
        ]
        made["programs"][name] = [
            mesh_of(solids(name, draw_style(rng), draw_choices(rng), size), size) for size in sizes
        ]
        if sdf:
            grids = model.sample_shapes(graph, boxes, generator=generator).float().numpy()
            made["sdf"][name] = []
            for grid, size in zip(grids, sizes, strict=True):
                mesh = mesh_from_tsdf(grid)
                mesh.apply_scale(size / mesh.extents)
                made["sdf"][name].append(mesh)
    return made


def unit(clouds: np.ndarray) -> np.ndarray:
    """Clouds (n, p, 3) moved and stretched into the unit box."""
    low, high = clouds.min(1, keepdims=True), clouds.max(1, keepdims=True)
    return ((clouds - low) / np.maximum(high - low, 1e-6) - 0.5).astype(np.float32)


def main() -> None:
    """Print what is named and how far the sets lie apart."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sources", nargs="*", type=Path)
    parser.add_argument("--least", type=int, default=8, help="real meshes that a class needs")
    parser.add_argument("--per-class", type=int, default=16)
    parser.add_argument("--seeds", type=int, default=1, help="draws of all pieces")
    parser.add_argument("--sdf", action="store_true", help="the field branch as well")
    parser.add_argument("--cache", type=Path, default=Path("real_clouds.npz"))
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    real = {name: v for name, v in real_clouds(asked.sources, asked.cache).items() if len(v) >= asked.least}
    classes = sorted(real)
    points = np.concatenate([real[name] for name in classes])
    label = np.repeat(np.arange(len(classes)), [len(real[name]) for name in classes])
    fold = np.random.default_rng(0).permutation(len(label)) % FOLDS
    own = [
        named(trained(points[fold != k], label[fold != k], len(classes), k), points[fold == k], label[fold == k])
        for k in range(FOLDS)
    ]
    judges = [trained(points, label, len(classes), seed) for seed in range(JUDGES)]
    words = np.repeat(np.arange(len(classes)), asked.per_class)
    out: dict = {"classes": {name: len(real[name]) for name in classes}, "real meshes, held out": float(np.mean(own))}
    model, references = EchoModel.load(None), {name: unit(real[name]) for name in classes}
    found: dict[str, dict[str, list[float]]] = {}
    for seed in range(5, 5 + asked.seeds):
        for kind, made in pieces(model, classes, asked.per_class, seed, sdf=asked.sdf).items():
            clouds = {name: np.stack([cloud(mesh) for mesh in made[name]]) for name in classes}
            every = np.concatenate([clouds[name] for name in classes])
            by_class = set_scores({name: unit(v) for name, v in clouds.items()}, references).values()
            scores = {key: float(np.mean([one[key] for one in by_class])) for key in ("mmd", "cov", "acc")}
            scores["named"] = float(np.mean([named(judge, every, words) for judge in judges]))
            for key in ("named", "mmd", "cov", "acc"):
                found.setdefault(kind, {}).setdefault(key, []).append(scores[key])
    for kind, rows in found.items():
        out[kind] = {key: [round(float(f), 4) for f in (np.mean(v), np.std(v))] for key, v in rows.items()}
    if asked.json:
        print(json.dumps(out))
    else:
        for what, value in out.items():
            print(f"{what}: {value}")


if __name__ == "__main__":
    main()
