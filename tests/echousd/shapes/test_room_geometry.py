"""What a piece of furniture says about itself."""

import numpy as np
import trimesh

from echomodel.triangles import Mesh
from echousd.shapes.geometry import Collider, Geometry, Origin, Part


def piece(mesh):
    part = Part("mesh", Mesh.of(mesh), {"wood": np.arange(len(mesh.faces))})
    return Geometry((part,), (Collider("hull", Mesh.of(mesh.convex_hull), "convexHull"),), Origin("boxes"))


def test_closed_is_what_is_closed_after_merging_vertices():
    box = trimesh.creation.box((1, 1, 1))
    loose = trimesh.Trimesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    assert not loose.is_watertight
    assert piece(loose).watertight
    opened = trimesh.Trimesh(box.vertices, box.faces[:-1], process=False)
    assert not piece(opened).watertight
    touching = trimesh.util.concatenate([box, box.copy().apply_translation((1, 0, 0))])
    assert piece(touching).watertight  # four faces meet where two boards do, once their corners are one
