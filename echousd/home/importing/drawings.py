"""Drawings (DXF, SVG), whose layers say what a line is; buildings (IFC), read in a process that damage may end."""

import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import ParseError

import numpy as np
import shapely

from echomodel.files import raising
from echomodel.late import extra
from echousd.batches.executor import without_script
from echousd.graph import GraphError
from echousd.home.importing.found import MAP, SCREEN, Drawn, Hole, Piece, Room, kind_of, long_sides, rooms_between, span

MOST = 200_000  # strokes of a drawing


@dataclass(frozen=True, eq=False)
class Stroke:
    """A polyline: what its layer is called, (k, 2) points in metres in the source's axes, and whether it is closed."""

    layer: str
    points: np.ndarray
    closed: bool = False
    name: str = ""


@dataclass(frozen=True, eq=False)
class Block:
    """A symbol that is set into a drawing: its layer and name, and (k, 2) points of all that it draws."""

    layer: str
    name: str
    points: np.ndarray


def meaning(*words: str) -> str:
    """What a layer's or block's names say that it is: window, door, passage, piece, wall, room or nothing."""
    return kind_of("drawings", " ".join(words).lower().replace("_", " ").replace("-", " ")) or ""


def found_in(
    strokes: Sequence[Stroke], blocks: Sequence[Block], labels: Sequence[tuple[str, np.ndarray]], axes: np.ndarray,
    frame: str, ignored: Counter[str],
) -> Drawn:  # fmt: skip
    """What a drawing shows by its lines, symbols and labels (text and (2,) where).

    Raises `GraphError` where it has neither outlines of rooms nor walls that enclose any.
    """
    kinds: dict[str, list[Stroke]] = {}
    for stroke in strokes:
        kind = meaning(stroke.layer)
        kinds.setdefault(kind, []).append(stroke)
        if not kind:
            ignored[f"lines on layer {stroke.layer or '0'!r}"] += 1
    rooms = list(_rooms(kinds, [(text, axes @ where) for text, where in labels], axes))
    if not rooms:
        layers = Counter(stroke.layer or "0" for stroke in strokes)
        listed = ", ".join(f"{name} ({count})" for name, count in layers.most_common(6)) or "none"
        raise GraphError(
            f"no rooms; layers: {listed}; allowed: closed lines on a layer such as 'room', or lines that "
            "enclose rooms on one such as 'wall'"
        )
    holes = [
        Hole(f"{kind}_{number + 1}", kind, ends, tips=tips)
        for kind in ("door", "passage", "window")
        for number, (ends, tips) in enumerate(_holes(kinds.get(kind, ()), blocks, kind, axes))
    ]
    pieces = []
    symbols = [b for b in blocks if meaning(b.layer, b.name) in ("piece", "") and len(b.points)]
    for block in [*symbols, *(Block(s.layer, s.name, s.points) for s in kinds.get("piece", ()) if s.closed)]:
        middle, along, width, deep = long_sides(block.points @ axes.T)
        if min(width, deep) > 0.05:
            at, size = np.array([middle[0], 0.0, middle[1]]), np.array([width, np.nan, deep])
            pieces.append(Piece(block.name, (block.name,), at, np.array([-along[1], along[0]]), size, sides=4))
    lines = [stroke.points @ axes.T for stroke in strokes]
    return Drawn(frame, rooms, holes, pieces, lines=lines, ignored=ignored)


def _rooms(
    kinds: dict[str, list[Stroke]], labels: Sequence[tuple[str, np.ndarray]], axes: np.ndarray
) -> Iterator[Room]:
    """Outlines that are drawn, else what walls and the holes in them enclose; named by the text in them."""
    outlines = [(s.name, s.points @ axes.T) for s in kinds.get("room", ()) if s.closed]
    if not outlines:
        walls = [np.vstack([s.points, s.points[:1]]) if s.closed else s.points for s in kinds.get("wall", ())]
        walls += [s.points for kind in ("door", "window", "passage") for s in kinds.get(kind, ())]
        outlines = [("", corners) for corners in rooms_between([points @ axes.T for points in walls])]
    for number, (name, corners) in enumerate(outlines):
        shape = shapely.Polygon(corners) if len(corners) > 2 else shapely.Polygon()
        inside = [text for text, where in labels if shape.contains(shapely.Point(where))]
        words = tuple(filter(None, (name, *inside)))
        yield Room(words[0] if words else f"room_{number + 1}", words, corners)


def _holes(
    strokes: Sequence[Stroke], blocks: Sequence[Block], kind: str, axes: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
    """Ends, and tips of leaves: a symbol's long side, the radius of an arc, the middle of a box, or a line itself."""
    for block in blocks:
        if meaning(block.layer, block.name) == kind and len(block.points):
            middle, along, width, deep = long_sides(block.points @ axes.T)
            across = np.array([-along[1], along[0]])
            sides = [middle + across * deep / 2 * way for way in (-1, 1)]  # a leaf stands open within its symbol
            ends = [span(side, along, width)[0] for side in sides]
            ends += [span(middle + along * width / 2 * way, across, deep)[0] for way in (-1, 1)] if deep > 0.5 else []
            yield np.array([span(middle, along, width)[0], *ends]), None
    arcs = [found for stroke in strokes if (found := _arc(stroke.points @ axes.T)) is not None]
    yield from ((arc, arc[::-1, 1]) for arc in arcs)
    for stroke in strokes if not arcs else ():
        middle, along, width, _ = long_sides(stroke.points @ axes.T)
        yield span(middle, along, width), None


def _arc(points: np.ndarray) -> np.ndarray | None:
    """(2, 2, 2) float: from the middle of an arc, where the hinge is, to both of its ends; None for other lines."""
    if len(points) < 4:
        return None
    first, last, between = points[0], points[-1], points[len(points) // 2]
    rows = 2 * np.array([between - first, last - first])
    if abs(np.linalg.det(rows)) < 1e-6:
        return None
    hinge = np.linalg.solve(rows, [between @ between - first @ first, last @ last - first @ first])
    radii = np.linalg.norm(points - hinge, axis=1)
    if np.ptp(radii) > 0.03 or not 0.4 < radii[0] < 2.5:
        return None
    return np.array([[hinge, first], [hinge, last]])


# -- DXF ---------------------------------------------------------------------------------------------------------------


def read_dxf(path: Path, unit: float | None) -> Drawn:
    """A DXF in the unit that it states, or in `unit` metres; x is east, y north. Raises `GraphError`."""
    ezdxf = extra("ezdxf", "DXF needs ezdxf", "dxf", GraphError)
    from ezdxf import path as paths
    from ezdxf import recover
    from ezdxf.enums import InsertUnits
    from ezdxf.units import conversion_factor

    with raising("cannot be read as DXF", ezdxf.DXFError, OSError, ValueError, kind=GraphError):
        document, _ = recover.readfile(path)
    stated = document.units
    if unit is None and stated == 0:
        raise GraphError("states no unit ($INSUNITS), allowed: --unit m, cm, mm, in, ft or metres of one unit")
    scale = unit if unit is not None else float(conversion_factor(InsertUnits(stated), InsertUnits.Meters))
    strokes, blocks, labels, ignored = [], [], [], Counter[str]()

    def points(entity: Any) -> np.ndarray:
        drawn = paths.make_path(entity)
        return np.array([(p.x, p.y) for p in drawn.flattening(0.02 / scale, segments=8)]).reshape(-1, 2) * scale

    def shown(entity: Any) -> Iterator[Any]:
        return (one for one in entity.virtual_entities() if one.dxftype() in DRAWN)

    entity: Any
    for entity in document.modelspace():
        kind, layer = entity.dxftype(), entity.dxf.layer
        if kind in DRAWN:
            closed = bool(getattr(entity, "closed", False) or getattr(entity, "is_closed", False))
            strokes.append(Stroke(layer, points(entity), closed))
        elif kind == "INSERT":
            parts = [points(one) for one in shown(entity)]
            blocks.append(Block(layer, entity.dxf.name, np.concatenate(parts) if parts else np.zeros((0, 2))))
        elif kind in ("TEXT", "MTEXT"):
            text = entity.dxf.text if kind == "TEXT" else entity.plain_text()
            where = entity.get_placement()[1] if kind == "TEXT" else entity.dxf.insert
            labels.append((text.split("\n")[0].strip(), np.array([where.x, where.y]) * scale))
        else:
            ignored[kind.lower()] += 1
        if len(strokes) > MOST:
            raise GraphError(f"more than {MOST} lines, allowed: that many")
    frame = f"{scale:g} m a unit ({'as told' if unit is not None else 'as the file says'}), x is east, y north"
    return found_in(strokes, blocks, labels, MAP, frame, ignored)


DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")

# -- SVG ---------------------------------------------------------------------------------------------------------------


def read_svg(content: bytes, unit: float | None) -> Drawn:
    """An SVG of which one unit is `unit` metres; x is east, y south. Raises `GraphError`."""
    svgelements = extra("svgelements", "SVG needs svgelements", "svg", GraphError)
    curves = svgelements.Arc | svgelements.CubicBezier | svgelements.QuadraticBezier
    if unit is None:
        raise GraphError(
            "an SVG has no scale, allowed: --unit with the metres of one of its units, such as --unit 0.01"
        )
    if b"<!ENTITY" in content:
        raise GraphError("defines entities, allowed: none")
    if b"<dc:title>echousd</dc:title>" in content:
        raise GraphError("a picture that echousd drew, which has no layers, allowed: the plan as .dxf, .json or .usda")
    content = re.sub(rb"<path(?![^>]*\sd\s*=)", b'<path d=""', content)  # of nothing, which svgelements does not know
    with raising("cannot be read as SVG", ParseError, ValueError, kind=GraphError):
        shown = svgelements.SVG.parse(io.BytesIO(content), ppi=96, reify=True)
    box = getattr(shown, "viewbox", None)
    # the size on paper is no scale
    unit = unit * (box.width / shown.width if box and box.width and shown.width else 1.0)
    strokes: list[Stroke] = []
    labels = []

    def walk(group: Any, layer: str) -> None:
        for one in group:
            values = getattr(one, "values", {})
            own = " ".join(filter(None, (values.get("class"), one.id, values.get(INKSCAPE))))
            if isinstance(one, svgelements.Group):
                walk(one, f"{layer} {own}".strip())
            elif isinstance(one, svgelements.Text):
                labels.append((str(one.text), np.array([one.x, one.y], float) * unit))
            elif isinstance(one, svgelements.Shape):
                for part in svgelements.Path(one).as_subpaths():
                    line = svgelements.Path(part)
                    curved = any(isinstance(segment, curves) for segment in line)
                    dots = [line.point(t) for t in np.linspace(0, 1, 17)] if curved else [part.end for part in line]
                    points = np.array([(p.x, p.y) for p in dots if p is not None], float) * unit
                    closed = any(isinstance(segment, svgelements.Close) for segment in line)
                    if len(points) > 1:
                        strokes.append(Stroke(own if meaning(own) else layer, points, closed, one.id or ""))

    walk(shown, "")
    if len(strokes) > MOST:
        raise GraphError(f"more than {MOST} lines, allowed: that many")
    frame = f"{unit:g} m a unit (as told), up of the picture is north"
    return found_in(strokes, (), labels, SCREEN, frame, Counter())


INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}label"


FURNITURE = ("IfcFurnishingElement", "IfcSanitaryTerminal", "IfcElectricAppliance", "IfcFlowTerminal")
FLAT = 0.5  # of a normal's upright part, from which a face belongs to a floor or ceiling


def read_ifc(path: Path, unit: float | None) -> Drawn:
    """The building in an IFC file, z up, y north, in the unit that it states. Raises `GraphError`."""
    with without_script(), ProcessPoolExecutor(1, mp_context=get_context("spawn")) as apart:
        try:
            return apart.submit(read_here, str(path), unit).result()
        except BrokenProcessPool:
            raise GraphError("ends the program that reads it, allowed: a file that IfcOpenShell reads") from None


def read_here(path: str, unit: float | None) -> Drawn:
    """As `read_ifc`, in this process."""
    ifcopenshell = extra("ifcopenshell", "IFC needs ifcopenshell", "ifc", GraphError)
    from ifcopenshell import geom
    from ifcopenshell.util import element, shape

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
    frame = f"{'its own units' if scale == 1 else f'{scale:g} m a unit (as told)'} in metres, z up, y is north"
    return Drawn(frame, rooms, holes, pieces, storeys, lines, ignored)


def _of_type(file: Any, name: str) -> list[Any]:
    """Products of a type, none where the file's schema does not know it."""
    try:
        return list(file.by_type(name))
    except RuntimeError:
        return []
