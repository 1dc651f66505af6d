"""Rooms as bodies: furniture of the programs in every box, the same pieces for every system, and what they run into."""

from __future__ import annotations

import zlib
from collections.abc import Sequence

import numpy as np
import shapely
import trimesh

from echomodel.furniture import Choices, Style, mesh_of, solids
from echomodel.metrics.statistics import Pair
from echomodel.roomboxes import RoomBoxes

APART = 0.005  # metres that two bodies are moved apart before they are looked at again
INSIDE = 0.99  # share of the points of a body that must lie over the floor
PER_VOLUME, FEWEST = 5000, 1000  # points to a cubic metre of its box, and at least


def bodies(room: RoomBoxes, seed: int) -> list[trimesh.Trimesh]:
    """A mesh for every box, in the room: which pieces depends on the room's name and the seed alone."""
    rng = np.random.default_rng([seed, zlib.crc32(room.id.encode())])
    out = []
    for k, word in enumerate(room.categories):
        style, choices = Style.draw(rng), Choices.draw(rng)
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
