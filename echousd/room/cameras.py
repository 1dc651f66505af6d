"""Cameras that belong to a room: a view from above and one from a corner."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd, UsdGeom

from echousd.room.volume import Volume
from echousd.sight import Furniture
from echousd.views import APERTURE, FOCAL_LENGTH, MARGIN, WIDE, inside_view, perspective_view

FAR = 10.0  # widths of the room that the camera above is away: heights hardly show
TENTHS = 0.01  # what a millimetre is in USD's lens unit, tenths of a scene unit, here of a metre


def write_cameras(
    stage: Usd.Stage,
    volume: Volume,
    points: np.ndarray,
    furniture: Furniture,
    walled: np.ndarray | None = None,
    hung: Furniture | None = None,
) -> None:
    """Author `/Room/Cameras/top` (from afar, -Z up in the picture) and `/Room/Cameras/perspective`.

    Arguments:
        stage: receives the cameras.
        volume: of the room. points, furniture: see `perspective_view`.
        walled: corners of the floor of a room with walls; its perspective camera stands inside.
        hung: what hangs or stands at the walls and must not fill that camera's picture.
    """
    UsdGeom.Scope.Define(stage, "/Room/Cameras")
    top = UsdGeom.Camera.Define(stage, "/Room/Cameras/top")
    # from afar rather than orthographic, whose width Blender takes for ten times what it is
    width = float((volume.upper - volume.lower)[[0, 2]].max()) * MARGIN
    height = float(volume.upper[1]) + FAR * width
    top.CreateFocalLengthAttr(FAR * APERTURE * TENTHS)
    for aperture in (top.CreateHorizontalApertureAttr(), top.CreateVerticalApertureAttr()):
        aperture.Set(APERTURE * TENTHS)
    top.CreateFocusDistanceAttr(height)
    top.AddTranslateOp().Set(Gf.Vec3d(float(volume.centre[0]), height, float(volume.centre[2])))
    top.AddRotateXOp().Set(-90.0)
    top.CreateClippingRangeAttr(Gf.Vec2f(0.5 * FAR * width, height + 1.0))
    camera = UsdGeom.Camera.Define(stage, "/Room/Cameras/perspective")
    if walled is not None:
        matrix = inside_view(walled, furniture, float(volume.upper[1]), hung)
    else:
        matrix = perspective_view(points, furniture)
    camera.AddTransformOp().Set(Gf.Matrix4d(np.ascontiguousarray(matrix.T)))
    camera.CreateFocalLengthAttr((WIDE if walled is not None else FOCAL_LENGTH) * TENTHS)
    camera.CreateHorizontalApertureAttr(APERTURE * TENTHS)
    camera.CreateVerticalApertureAttr(APERTURE * TENTHS)
    distance = float(np.linalg.norm(matrix[:3, 3] - volume.centre))
    camera.CreateFocusDistanceAttr(distance)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.05, 4 * distance + 10.0))
