"""Plain boxes as meshes."""

import numpy as np
import trimesh


def box_mesh(size):
    """A plain box of (3,) `size` metres standing on the origin."""
    x, y, z = np.asarray(size, float)
    return trimesh.creation.box(bounds=[(-x / 2, 0.0, -z / 2), (x / 2, y, z / 2)])
