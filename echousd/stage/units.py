"""Unit and up axis of a stage whose root layer may leave them open: then the layer that defines the room says them.

OpenUSD reads both from the root layer alone and takes centimetres and its own up axis where nothing is said, so that a
stronger layer without them shows a room of metres a hundred times too small.
"""

import numpy as np
from pxr import Sdf, Usd, UsdGeom

METRES = "metersPerUnit"
UP_AXIS = "upAxis"
Z_TO_Y = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # (x, y, z) with Z up -> (x, z, -y)


def metres_per_unit(stage: Usd.Stage) -> float:
    """Metres per unit of a stage."""
    layer = _speaker(stage, METRES)
    return float(layer.pseudoRoot.GetInfo(METRES)) if layer else float(UsdGeom.GetStageMetersPerUnit(stage))


def up_axis(stage: Usd.Stage) -> str:
    """`Y` or `Z`."""
    layer = _speaker(stage, UP_AXIS)
    return str(layer.pseudoRoot.GetInfo(UP_AXIS)) if layer else str(UsdGeom.GetStageUpAxis(stage))


def upwards(stage: Usd.Stage) -> np.ndarray:
    """(3,) float: the direction in which a stage has its up axis."""
    return np.array([0.0, 0, 1] if up_axis(stage) == "Z" else [0.0, 1, 0])


def to_metres(stage: Usd.Stage) -> np.ndarray:
    """(4, 4) float, column vectors: from a stage's world to metres with +Y up."""
    return metres_from(metres_per_unit(stage), up_axis(stage))


def metres_from(unit: float, up: str) -> np.ndarray:
    """(4, 4) float, column vectors: from a world with so many metres a unit, `Y` or `Z` up, to metres with +Y up."""
    out = np.eye(4)
    out[:3, :3] = (Z_TO_Y if up == "Z" else np.eye(3)) * unit
    return out


def set_units(layer: Sdf.Layer, stage: Usd.Stage) -> None:
    """Have a layer that holds what a stage composes to say unit and up axis as well."""
    for key, value in ((METRES, metres_per_unit(stage)), (UP_AXIS, up_axis(stage))):
        if not layer.pseudoRoot.HasInfo(key):
            layer.pseudoRoot.SetInfo(key, value)


def conventions(stage: Usd.Stage, path: str | None = None) -> dict[str, float | str]:
    """What a stage says of its unit, its up axis and the path of its room, by the names of a room's options.

    Arguments:
        path: of the room; None = of the only one, which a stage without graphs leaves open.

    Raises ValueError for several rooms.
    """
    from echousd.stage.read import find_rooms

    found: dict[str, float | str] = {}
    if _speaker(stage, METRES):
        found["meters_per_unit"] = round(metres_per_unit(stage), 9)
    if _speaker(stage, UP_AXIS):
        found["up_axis"] = up_axis(stage)
    paths = [str(prims.room.GetPath()) for prims in find_rooms(stage)] if path is None else [path]
    if len(paths) > 1:
        file, named = stage.GetRootLayer().realPath, ", ".join(paths)
        raise ValueError(f"{file}: {len(paths)} rooms, name one (room_path): {named}")
    return {**found, **({"room_path": paths[0]} if paths else {})}


def _speaker(stage: Usd.Stage, key: str) -> Sdf.Layer | None:
    """The strongest layer that sets a stage's metadatum: of the layer stack, else of what defines the first prims."""
    layers = stage.GetLayerStack(includeSessionLayers=False)
    defining = [spec.layer for prim in stage.GetPseudoRoot().GetChildren() for spec in prim.GetPrimStack()]
    return next((layer for layer in (*layers, *defining) if layer.pseudoRoot.HasInfo(key)), None)
