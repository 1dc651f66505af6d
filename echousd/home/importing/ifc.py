"""Buildings in IFC: spaces, doors, windows, furniture; read in a process of its own, which a damaged file may end."""

from __future__ import annotations

from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from echousd.graph import GraphError
from echousd.home.importing.found import MAP, Found, Hole, Piece, Room, long_sides, span

FURNITURE = ("IfcFurnishingElement", "IfcSanitaryTerminal", "IfcElectricAppliance", "IfcFlowTerminal")
FLAT = 0.5  # of a normal's upright part, from which a face belongs to a floor or ceiling


def read_ifc(path: Path, unit: float | None) -> Found:
    """The building in an IFC file, z up, y north, in the unit that it states. Raises `GraphError`."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as apart:
        try:
            return apart.submit(read_here, str(path), unit).result()
        except BrokenProcessPool:
            raise GraphError("ends the program that reads it, allowed: a file that IfcOpenShell reads") from None


def read_here(path: str, unit: float | None) -> Found:
    """As `read_ifc`, in this process."""
    try:
        import ifcopenshell
        from ifcopenshell import geom
        from ifcopenshell.util import element, shape
    except ImportError:
        raise GraphError('IFC needs ifcopenshell: pip install "echousd[ifc]"') from None
    try:
        file = ifcopenshell.open(path)
    except Exception as error:  # of any kind, from the C++ library
        raise GraphError(f"cannot be read as IFC ({str(error).splitlines()[0] if str(error) else 'damaged'})") from None
    if not file.by_type("IfcUnitAssignment") and unit is None:
        raise GraphError("states no units, allowed: --unit m, cm, mm, in, ft or metres of one unit")
    scale = 1.0 if file.by_type("IfcUnitAssignment") else float(unit or 1.0)
    settings = geom.settings()
    settings.set("use-world-coords", True)
    ignored = Counter[str]()

    def mesh(product: Any) -> tuple[np.ndarray, np.ndarray] | None:
        try:
            made: Any = geom.create_shape(settings, product)
        except RuntimeError:
            ignored[f"{product.is_a()} without a shape that can be made"] += 1
            return None
        return shape.get_vertices(made.geometry) * scale, shape.get_faces(made.geometry)

    def storey(product: Any) -> str:
        above = element.get_container(product) or element.get_aggregate(product)
        while above is not None and not above.is_a("IfcBuildingStorey"):
            above = element.get_aggregate(above) or element.get_container(above)
        return "" if above is None else above.Name or above.GlobalId

    rooms: list[Room] = []
    lows: dict[str, float] = {}
    for space in file.by_type("IfcSpace"):
        if (made := mesh(space)) is None:
            continue
        points, faces = made
        corners = points[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat = corners[np.abs(normals[:, 2]) > FLAT * np.linalg.norm(normals, axis=1).clip(1e-12)]
        outline = shapely.union_all([shapely.Polygon(one[:, :2]).buffer(0) for one in flat])
        outline = max(shapely.get_parts(outline), key=lambda part: part.area, default=None)
        if outline is None or outline.is_empty:
            ignored["IfcSpace without a floor"] += 1
            continue
        level, name = storey(space), space.LongName or space.Name or f"room_{len(rooms) + 1}"
        lows.setdefault(level, float(points[:, 2].min()))
        floor = np.array(outline.simplify(0.01).exterior.coords)[:-1] @ MAP.T
        words = (name, space.Name or "", getattr(space, "ObjectType", None) or "")
        rooms.append(Room(name, words, floor, float(np.ptp(points[:, 2])), level))
    holes = []
    for kind, type_ in (("door", "IfcDoor"), ("window", "IfcWindow")):
        for one in file.by_type(type_):
            filled = [rel.RelatingOpeningElement for rel in getattr(one, "FillsVoids", ())]
            made = mesh(filled[0] if filled else one)  # the hole where it is stated, else what stands in it
            if made is not None:
                middle, along, width, _ = long_sides(made[0][:, :2] @ MAP.T)
                low, level = made[0][:, 2].min(), storey(one)
                sill = max(float(low) - lows.get(level, 0.0), 0.0) if kind == "window" else None
                ends, name = span(middle, along, width), one.Name or one.GlobalId
                holes.append(Hole(name, kind, ends, float(np.ptp(made[0][:, 2])), sill, level))
    pieces, seen = [], set()
    for one in (product for type_ in FURNITURE for product in _of_type(file, type_)):
        if one.id() in seen or (made := mesh(one)) is None:
            continue
        seen.add(one.id())
        middle, along, width, deep = long_sides(made[0][:, :2] @ MAP.T)
        at = np.array([middle[0], made[0][:, 2].min() - lows.get(storey(one), 0.0), middle[1]])
        size, called = np.array([width, np.ptp(made[0][:, 2]), deep]), (one.Name or "", one.ObjectType or "")
        name = one.Name or one.is_a()
        pieces.append(Piece(name, called, at, np.array([-along[1], along[0]]), size, sides=4, storey=storey(one)))
    walls = [made[0][:, :2] for one in file.by_type("IfcWall") if (made := mesh(one)) is not None]
    lines = [np.array(shapely.MultiPoint(w @ MAP.T).minimum_rotated_rectangle.exterior.coords) for w in walls]
    storeys = sorted({room.storey for room in rooms}, key=lambda level: lows.get(level, 0.0))
    told = f"{'its own units' if scale == 1 else f'{scale:g} m a unit (as told)'} in metres, z up, y is north"
    return Found(told, rooms, holes, pieces, storeys, lines, ignored)


def _of_type(file: Any, name: str) -> list[Any]:
    """Products of a type, none where the file's schema does not know it."""
    try:
        return list(file.by_type(name))
    except RuntimeError:
        return []
