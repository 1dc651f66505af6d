"""A closed box without furniture, and sheets in it, for pictures of one thing each."""

from dataclasses import replace

import numpy as np
import trimesh
from pxr import Usd, UsdGeom

from echousd.draw.scenery import read_scenery
from echousd.draw.views import View, view_matrix

LAMP = {"bulbs": np.array([[(0.0, 1.5, 0.0)]], np.float32), "power": np.ones((1, 3), np.float32)}


def box_room(**lights) -> tuple:
    """The camera on a floor of a closed box without furniture, and the scenery, lit as told."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    box = trimesh.creation.box((4, 3, 4))
    box.invert()
    mesh = UsdGeom.Mesh.Define(stage, "/Box")
    mesh.CreatePointsAttr((box.vertices + np.array([0, 1.5, 0])).astype(np.float32))
    mesh.CreateFaceVertexCountsAttr([3] * 12)
    mesh.CreateFaceVertexIndicesAttr(box.faces.ravel().tolist())
    scenery = read_scenery(stage)
    down = View(view_matrix(np.array([0.0, 2.5, 0.0]), np.array([0.01, 0.0, 0.0])), 0.7, False, inside=True)
    return replace(scenery, lights=replace(scenery.lights, **lights)), down


def with_sheet(scenery, corners: np.ndarray, **values):
    """The scenery and an upright or level rectangle (4, 3) in it, whose colours, glow or texture are told."""
    triangles = corners.astype(np.float32)[[[0, 1, 2], [0, 2, 3]]]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    added = {
        "triangles": triangles, "normals": np.broadcast_to(normal / np.linalg.norm(normal), (2, 3, 3)),
        "flat_colors": np.full((2, 3), 0.5), "emissive": np.zeros((2, 3)), "gloss": np.zeros(2), "thin": np.zeros(2),
        "st": np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)[[[0, 1, 2], [0, 2, 3]]], "texture": np.full((2, 2), -1),
        "wall": np.full(2, -1), **values,
    }  # fmt: skip
    joined = {key: np.concatenate([getattr(scenery, key), more]) for key, more in added.items()}
    return replace(scenery, **{key: value.astype(getattr(scenery, key).dtype) for key, value in joined.items()})


def level_sheet(x: float, z: float, y: float = 0.05) -> np.ndarray:
    """(4, 3) corners of a rectangle of these sides about the middle of the room, facing up."""
    return np.array([(-x, y, z), (x, y, z), (x, y, -z), (-x, y, -z)]) / (2, 1, 2)
