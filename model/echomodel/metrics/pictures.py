"""Rooms from above as the paper pictures them, and what networks see in such pictures: FID, KID, FID-CLIP, a small CNN.

The published renders come from pyrender: 256 x 256, 90 degrees from 8 m above the middle, no floor, walls or lamps, a
colour a class; its shader is followed here term by term. Features are those of clean-fid, by weights from the disk.

Bodies stand in the boxes: furniture of the programs, the same pieces for every system, and what they run into.
"""

import colorsys
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import shapely
import torch
import trimesh
from PIL import Image
from torch import nn

from echomodel.furniture import draw_choices, draw_style, mesh_of, solids
from echomodel.late import extra
from echomodel.metrics.sets import frechet_distance, kernel_distance, with_subsets
from echomodel.metrics.statistics import Figure, Pair, mean
from echomodel.roomboxes import RoomBoxes
from echomodel.text import ClipTextEncoder
from echomodel.vocabulary import vocabulary

APART = 0.005  # metres that two bodies are moved apart before they are looked at again
INSIDE = 0.99  # share of the points of a body that must lie over the floor
PER_VOLUME, FEWEST = 5000, 1000  # points to a cubic metre of its box, and at least


def bodies(room: RoomBoxes, seed: int) -> list[trimesh.Trimesh]:
    """A mesh for every box, in the room: which pieces depends on the room's name and the seed alone."""
    rng = np.random.default_rng([seed, zlib.crc32(room.id.encode())])
    out = []
    for k, word in enumerate(room.categories):
        style, choices = draw_style(rng), draw_choices(rng)
        size = np.maximum(room.size[k], 0.02)
        mesh = mesh_of(solids(word, style, choices, size), size)
        matrix = trimesh.transformations.rotation_matrix(float(room.yaw[k]), [0, 1, 0])
        matrix[:3, 3] = room.position[k]
        out.append(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).apply_transform(matrix))
    return out


def body_scores(room: RoomBoxes, seed: int) -> dict[str, Pair]:
    """SceneEval's collision and bounds: bodies that run into another one, rooms with such, bodies beyond the floor."""
    made = bodies(room, seed)
    hit, objects = {k for pair in collisions(made) for k in pair}, float(len(room))
    scores: dict[str, Pair] = {"colliding": (float(len(hit)), objects), "rooms colliding": (float(bool(hit)), 1.0)}
    if len(room.floor_polygon) > 2:
        scores["out of bounds"] = float(sum(out_of_bounds(made, room.floor_polygon))), objects
    return scores


def collisions(meshes: Sequence[trimesh.Trimesh]) -> list[tuple[int, int]]:
    """Pairs whose surfaces cross, and still do when the second is moved 5 mm away from where they touch (FCL)."""
    from trimesh.collision import CollisionManager

    low, high = (np.array([mesh.bounds[k] for mesh in meshes]) for k in (0, 1))
    found = []
    for i, one in enumerate(meshes):
        near = np.flatnonzero((low[i] <= high).all(1) & (high[i] >= low).all(1))
        near = near[near > i]
        if not len(near):
            continue
        manager = CollisionManager()
        manager.add_object("one", one)
        for j in near.tolist():
            hit, contacts = manager.in_collision_single(meshes[j], return_data=True)
            if not hit:
                continue
            way = meshes[j].centroid - np.mean([contact.point for contact in contacts], axis=0)
            moved = meshes[j].copy().apply_translation(APART * way / max(float(np.linalg.norm(way)), 1e-9))
            if manager.in_collision_single(moved):
                found.append((i, j))
    return found


def out_of_bounds(meshes: Sequence[trimesh.Trimesh], floor: np.ndarray) -> list[bool]:
    """Which bodies have more than 1 % of points on their surface off the floor's polygon, (k, 2) metres, in plan."""
    polygon, out = shapely.Polygon(floor), []
    shapely.prepare(polygon)
    for mesh in meshes:
        count = int(max(PER_VOLUME * float(np.prod(mesh.extents)), FEWEST))
        points, _ = trimesh.sample.sample_surface(mesh, count, seed=0)
        out.append(bool(shapely.contains_xy(polygon, points[:, 0], points[:, 2]).mean() < INSIDE))
    return out


SIDE, FINER, HEIGHT = 256, 2, 8.0  # pixels, rays along each side of one, metres
SUN, LAMP = 2.0, 20.0  # pyrender's directional light, and its point light at the camera
BASE, METAL, ROUGH, DIELECTRIC = 0.3, 0.2, 0.8, 0.04  # pyrender's default material
SMALL, TURNS, STEPS, RATE = 64, 4, 120, 3e-3  # of the small CNN: pixels, quarter turns, steps of training, their rate
WEIGHTS = {
    "inception": "inception-2015-12-05.pt, as clean-fid uses it: "
    "nvlabs-fi-cdn.nvidia.com/stylegan2-ada-pytorch/pretrained/metrics/inception-2015-12-05.pt",
    "clip": "OpenAI's ViT-B-32.pt, whose address stands in github.com/openai/CLIP, clip/clip.py (extra text)",
}


def picture(room: RoomBoxes, seed: int) -> np.ndarray:
    """The room from above with the furniture of `bodies`: (256, 256, 3) uint8, +X to the right, +Z down.

    Raises ValueError where Embree is not installed.
    """
    rtcore_scene = extra("embreex.rtcore_scene", "pictures need Embree", "render")
    from embreex.mesh_construction import TriangleMesh

    classes = [vocabulary().category(word).coarse for word in room.categories]
    meshes = [(mesh, word) for mesh, word in zip(bodies(room, seed), classes, strict=True) if word != "lamp"]
    side = SIDE * FINER
    if not meshes:
        return np.full((SIDE, SIDE, 3), 255, np.uint8)
    triangles = np.concatenate([mesh.triangles for mesh, _ in meshes])
    normals = np.concatenate([mesh.face_normals for mesh, _ in meshes])
    colours = np.repeat([_colour(word) for _, word in meshes], [len(mesh.faces) for mesh, _ in meshes], axis=0)
    corners = room.floor_polygon if len(room.floor_polygon) else room.position[:, [0, 2]]
    middle = (corners.min(0) + corners.max(0)) / 2
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, (triangles - [middle[0], 0, middle[1]]).astype(np.float32))
    across = ((np.arange(side) + 0.5) / side * 2 - 1).astype(np.float32)
    x, z = (grid.ravel() for grid in np.meshgrid(across, across))
    way = np.stack([x, -np.ones_like(x), z], 1)
    hit = scene.run(np.tile(np.array([0, HEIGHT, 0], np.float32), (len(way), 1)), way, query="INTERSECT", output=True)
    met = np.flatnonzero(hit["primID"] >= 0)
    face, to_camera = hit["primID"][met], -way[met] * hit["tfar"][met, None]
    light = _shaded(normals[face], to_camera.astype(float))
    out = np.ones((side * side, 3))
    out[met] = (light[:, None] * colours[face]) ** (1 / 2.2)
    return np.round(out.clip(0, 1).reshape(SIDE, FINER, SIDE, FINER, 3).mean((1, 3)) * 255).astype(np.uint8)


@cache
def _colour(word: str) -> tuple[float, float, float]:
    """Of seaborn's `hls` palette of as many colours as the paper has classes."""
    classes = vocabulary().coarse_categories
    return colorsys.hls_to_rgb((classes.index(word) / len(classes) + 0.01) % 1, 0.6, 0.65)


def _shaded(normal: np.ndarray, to_camera: np.ndarray) -> np.ndarray:
    """Light (n,) that white surfaces send to the camera, by pyrender's shader; `to_camera` (n, 3) is not normalised."""
    far = np.linalg.norm(to_camera, axis=1)
    view, up = to_camera / far[:, None], np.tile([0.0, 1.0, 0.0], (len(far), 1))
    return _reflected(normal, view, up) * SUN + _reflected(normal, view, view) * LAMP / far**2


def _reflected(normal: np.ndarray, view: np.ndarray, light: np.ndarray) -> np.ndarray:
    half = light + view
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    nl = (normal * light).sum(1).clip(0.001, 1)
    nv = np.abs((normal * view).sum(1)).clip(0.001, 1)
    nh, vh = ((a * half).sum(1).clip(0, 1) for a in (normal, view))
    diffuse = BASE * (1 - DIELECTRIC) * (1 - METAL)
    facing = DIELECTRIC * (1 - METAL) + BASE * METAL
    fresnel = facing + (1 - facing) * (1 - vh) ** 5
    k, square = (ROUGH + 1) ** 2 / 8, ROUGH**4
    masked = nv / (nv * (1 - k) + k) * nl / (nl * (1 - k) + k)
    spread = square / (np.pi * (nh**2 * (square - 1) + 1) ** 2)
    return nl * ((1 - fresnel) * diffuse / np.pi + fresnel * masked * spread / (4 * nl * nv + 0.001))


def features(pictures: np.ndarray, kind: str, weights: str) -> np.ndarray:
    """What a published network sees: (n, 256, 256, 3) uint8 -> (n, D) float64; raises ValueError for unfit weights.

    Arguments:
        kind: of `WEIGHTS`; `inception` (2048 numbers, FID and KID), `clip` (512, FID-CLIP). weights: its file.
    """
    if not Path(weights).is_file():
        raise ValueError(f"{weights}: no such file, --{kind} wants {WEIGHTS[kind]}")
    try:
        net = _network(kind, weights)
        with torch.inference_mode():
            parts = [net(part) for part in np.array_split(pictures, max(1, len(pictures) // 16))]
        return torch.cat(parts).flatten(1).double().numpy()
    except (RuntimeError, AttributeError) as error:
        reason = (str(error).strip() or type(error).__name__).splitlines()[0][:120]
        raise ValueError(
            f"{weights}: not the weights that --{kind} wants ({reason}); allowed: {WEIGHTS[kind]}"
        ) from None


@cache
def _network(kind: str, weights: str) -> Callable[[np.ndarray], torch.Tensor]:
    if kind == "clip":
        mean, spread = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)
        encode: Callable = ClipTextEncoder(weights).model.encode_image  # type: ignore[assignment]
        return lambda pictures: encode(_planes(pictures, 224, 255 * np.array(mean), 255 * np.array(spread))).float()
    layers = torch.jit.load(weights, map_location="cpu").eval().layers
    return lambda pictures: layers(_planes(pictures.astype(np.float32), 299, 128, 128))


def _planes(pictures: np.ndarray, side: int, mean: np.ndarray | int, spread: np.ndarray | int) -> torch.Tensor:
    """(n, 3, side, side) float32: bicubic by Pillow as clean-fid has it, in whole numbers where the pictures are."""
    size, bicubic = (side, side), Image.Resampling.BICUBIC
    out = np.empty((len(pictures), 3, side, side), np.float32)
    for number, shown in enumerate(pictures):
        for plane in range(3):
            out[number, plane] = np.asarray(Image.fromarray(shown[..., plane].copy()).resize(size, bicubic))
    scaled = (out.clip(0, 255) - np.reshape(mean, (-1, 1, 1))) / np.reshape(spread, (-1, 1, 1))
    return torch.from_numpy(scaled.astype(np.float32))


def picture_figures(ours: np.ndarray, theirs: np.ndarray, names: Sequence[str], seed: int) -> dict[str, Figure]:
    """The Frechet and, for two names, a thousand times the kernel distance of `features` (A, D) and (B, D)."""

    def measured(i: np.ndarray, j: np.ndarray) -> dict[str, float]:
        found = frechet_distance(ours[i], theirs[j]), 1000 * kernel_distance(ours[i], theirs[j])
        return dict(zip(names, found, strict=False))

    return with_subsets(measured, len(ours), len(theirs), seed)


def cnn_accuracy(made: np.ndarray, real: np.ndarray, seed: int) -> Figure:
    """Share of pictures that a small CNN, trained here on the other half, tells rightly as made or real; 0.5 = cannot.

    It is no published classifier. The n-th of both fall into the same half, so that no furniture is seen twice.

    `made`, `real`: (n, 256, 256, 3) uint8.
    """
    sides = [torch.from_numpy(part).permute(0, 3, 1, 2).float() / 127.5 - 1 for part in (made, real)]
    x = torch.cat([nn.functional.avg_pool2d(part, SIDE // SMALL) for part in sides])
    truth = torch.cat([torch.ones(len(made)), torch.zeros(len(real))])
    half = torch.cat([torch.arange(len(made)), torch.arange(len(real))]) % 2
    right = torch.zeros(len(x))
    for held in (0, 1):
        with torch.random.fork_rng(devices=()):
            torch.manual_seed(seed + held)
            net = nn.Sequential(
                nn.Conv2d(3, 16, 5, 2, 2), nn.ReLU(), nn.Conv2d(16, 32, 3, 2, 1), nn.ReLU(), nn.Conv2d(32, 32, 3, 2, 1),
                nn.ReLU(), nn.AdaptiveAvgPool2d(2), nn.Flatten(), nn.Linear(128, 1),
            )  # fmt: skip
            optimizer = torch.optim.AdamW(net.parameters(), RATE)
            seen, asked = x[half != held], truth[half != held]
            for _ in range(STEPS):
                turned = torch.rot90(seen, int(torch.randint(TURNS, ())), (2, 3))
                loss = nn.functional.binary_cross_entropy_with_logits(net(turned)[:, 0], asked)
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
            with torch.inference_mode():
                votes = sum(net(torch.rot90(x[half == held], k, (2, 3)))[:, 0] for k in range(TURNS))
        right[half == held] = ((votes > 0) == (truth[half == held] > 0)).float()
    return replace(mean(right.tolist(), seed), rooms=len(made))
