"""What a piece of furniture says about itself."""

import numpy as np
import trimesh

from echousd.shapes.geometry import Collider, Geometry, Origin, Part


def piece(mesh):
    part = Part("mesh", mesh, {"wood": np.arange(len(mesh.faces))})
    return Geometry((part,), (Collider("hull", mesh.convex_hull, "convexHull"),), Origin("boxes"))


def test_closed_is_what_is_closed_after_merging_vertices():
    box = trimesh.creation.box((1, 1, 1))
    loose = trimesh.Trimesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    assert not loose.is_watertight
    assert piece(loose).watertight
    opened = trimesh.Trimesh(box.vertices, box.faces[:-1], process=False)
    assert not piece(opened).watertight
