"""All that is seen on a stage as one mesh in metres, +Y up."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from pxr import UsdGeom

from echousd.stage.contents import is_seen, triangulated
from echousd.stage.files import open_stage
from echousd.stage.forms import forms
from echousd.stage.units import metres_per_unit, up_axis


def stage_mesh(path: Path) -> trimesh.Trimesh:
    """Everything with a surface on a stage as triangles; raises ValueError where there is none."""
    stage = open_stage(path)
    points, faces, count = [], [], 0
    for form in forms(stage.GetPseudoRoot(), UsdGeom.XformCache(), is_seen):
        vertices, triangles = triangulated(form.prim)
        if not len(triangles):
            continue
        points.append(vertices @ form.world[:3, :3].T + form.world[:3, 3])
        faces.append(triangles + count)
        count += len(vertices)
    if not points:
        raise ValueError("the stage holds no visible surfaces")
    vertices = np.concatenate(points) * metres_per_unit(stage)
    if up_axis(stage) == UsdGeom.Tokens.z:
        vertices = vertices[:, [0, 2, 1]] * [1, 1, -1]
    return trimesh.Trimesh(vertices, np.concatenate(faces), process=False)
