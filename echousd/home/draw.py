"""Plans as drawings: walls, doors, windows, names and areas; PNG, SVG and PDF, DXF for CAD, a house of ProcTHOR."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from echomodel.files import whole_file, write_json
from echomodel.late import extra
from echomodel.openings import Opening, direction, hinge_point, inward_normal, segment, signed_area, swing_area
from echomodel.vocabulary import vocabulary
from echousd.graph import GraphError
from echousd.graph.picture import save_figure
from echousd.home.importing.homes import room_kind
from echousd.home.importing.simulators import THOR
from echousd.home.plan import HomePlan, ways
from echousd.home.stages import Standing
from echousd.naming import free_name

TINTS = {"": "#f4efe4", "wet": "#e3eef4", "outdoor": "#e6f0df"}
# Of a DXF, with their colours.
LAYERS = {"wall": 7, "door": 3, "window": 5, "passage": 9, "room": 8, "furniture": 6, "dimension": 2}
INK = {"door": "#8a5a2b", "window": "#3a6ea5", "passage": "#c9c2b2"}
FRONT = [2, 3]  # corners of a footprint at its front
ASIDE = 0.5  # metres from the walls to what says how long they are
ACROSS = 5.0  # inches of one plan
WRITTEN = 0.17  # of a plan's longer side, which is drawn equally long: as far as words in a room reach


Place = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Line:
    """A polyline of a drawing in metres: (k, 2) float, z to the right and x upwards, as maps have east and north."""

    layer: str
    points: np.ndarray
    closed: bool = False


def on_paper(points: np.ndarray) -> np.ndarray:
    """(k, 2) float from (x, z) of the home: north (+X) is up, east (+Z) right."""
    return np.asarray(points, float)[..., ::-1]


def lines_of(plan: HomePlan) -> Iterator[Line]:
    """What a plan consists of: pieces of wall, leaves with their swings, panes, floors."""
    holes = []
    for name, floor in plan.floors.items():
        yield Line("room", on_paper(floor), closed=True)
        for opening in plan.openings[name]:
            near = segment(floor, opening)
            out = -inward_normal(floor, opening.edge) * (plan.walls[name][opening.edge] + 0.005)
            holes.append(shapely.Polygon([*near, *(near[::-1] + out)]).buffer(0.005))
            yield from _filled(floor, opening, near, out)
    for (name, _), opening in ways(plan):
        if opening.kind == "passage":
            yield Line("passage", on_paper(segment(plan.floors[name], opening)))
    cells = shapely.union_all([shapely.Polygon(cell) for cell in plan.cells.values()])
    floors = shapely.union_all([shapely.Polygon(floor) for floor in plan.floors.values()])
    solid = cells.difference(floors).difference(shapely.union_all(holes))
    for part in getattr(solid, "geoms", [solid]):
        for ring in (part.exterior, *part.interiors):
            yield Line("wall", on_paper(np.array(ring.coords)[:-1]), closed=True)


def _filled(floor: np.ndarray, opening: Opening, near: np.ndarray, out: np.ndarray) -> Iterator[Line]:
    """A leaf and its arc, or a pane; a passage holds nothing."""
    if opening.kind == "window":
        for share in (0.35, 0.65):
            yield Line("window", on_paper(near + share * out))
    swing = swing_area(floor, opening)
    if len(swing):
        hinge, _ = hinge_point(floor, opening)
        yield Line("door", on_paper(np.array([hinge, swing[-1]])))
        yield Line("door", on_paper(swing[1:]))


def dimensions_of(plan: HomePlan) -> Iterator[tuple[Place, Place, str]]:
    """Ends on paper and text of the lengths that a plan has outside: from wall to wall, below and left."""
    corners = on_paper(np.concatenate([*plan.cells.values()]))
    low, high = corners.min(0), corners.max(0)
    for axis in (0, 1):
        start, end = low - ASIDE, high - ASIDE
        start[axis], end[axis] = low[axis], high[axis]
        end[1 - axis] = start[1 - axis]
        yield (float(start[0]), float(start[1])), (float(end[0]), float(end[1])), f"{high[axis] - low[axis]:.2f} m"


def draw_plans(
    plans: Sequence[HomePlan], path: Path, over: Sequence[np.ndarray] = (), things: Sequence[Standing] = ()
) -> None:
    """Write a picture of plans side by side; the extension (.png, .svg, .pdf) chooses its form. Raises OSError.

    Arguments:
        over: (k, 2) float each, lines (x, z) of a drawing that the plans were taken from. things: that stand in them.
    """
    from matplotlib.figure import Figure

    wide = min(len(plans), 3)
    high = -(-len(plans) // wide)
    figure = Figure(figsize=(ACROSS * wide, ACROSS * high), dpi=140, layout="tight")
    for number, plan in enumerate(plans):
        axes = figure.add_subplot(high, wide, number + 1)
        axes.set_aspect("equal")
        axes.axis("off")
        narrow = WRITTEN * np.ptp(np.concatenate([*plan.cells.values()]), axis=0).max()
        for name, floor in plan.floors.items():
            row = vocabulary().room_type(plan.home.room(name).type)
            axes.fill(*on_paper(floor).T, color=TINTS[row.use])
            middle = shapely.Polygon(on_paper(floor)).representative_point()
            width, height = np.ptp(on_paper(floor), 0)
            label = f"{name.replace('_', ' ')}\n{abs(signed_area(floor)):.1f} m²\n{width:.2f} x {height:.2f} m"
            turn = 90 if width < min(height, narrow) else 0
            axes.text(middle.x, middle.y, label, ha="center", va="center", fontsize=7, rotation=turn)
        for line in lines_of(plan):
            points = np.vstack([line.points, line.points[:1]]) if line.closed else line.points
            if line.layer == "wall":
                axes.fill(*line.points.T, color="#3a3a3a")
            elif line.layer != "room":
                axes.plot(*points.T, color=INK[line.layer], linewidth=0.8)
        for thing in things:
            corners = on_paper(thing.corners)
            axes.fill(*corners.T, facecolor="#ffffff80", edgecolor="#7a7a7a", linewidth=0.5)
            axes.plot(*corners[FRONT].T, color="#7a7a7a", linewidth=1.4)  # where it looks
            word = thing.node.category.replace("_", "\n")
            x, y = corners.mean(0).tolist()
            axes.text(x, y, word, ha="center", va="center", fontsize=3.5, color="#5a5a5a")
        for start, end, label in dimensions_of(plan):
            axes.update_datalim([start, end])  # what is noted alone widens no picture
            axes.annotate("", start, end, arrowprops={"arrowstyle": "<->", "linewidth": 0.6})
            middle = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
            upright = 90 if start[0] == end[0] else 0
            box = {"facecolor": "white", "linewidth": 0, "pad": 1}
            axes.annotate(label, middle, fontsize=6, rotation=upright, ha="center", va="center", bbox=box)
        for points in over:
            axes.plot(*on_paper(points).T, color="#d02f2f", linewidth=0.5, alpha=0.8)
        axes.set_title(f"{plan.area:.1f} m²", fontsize=8)
    save_figure(figure, path)


def write_dxf(plan: HomePlan, path: Path, things: Sequence[Standing] = ()) -> None:
    """Write a plan as DXF in metres with what stands in it, a layer each; raises `GraphError` without ezdxf."""
    ezdxf = extra("ezdxf", "DXF needs ezdxf", "dxf", GraphError)
    drawing = ezdxf.new(units=6)  # metres
    for name, colour in LAYERS.items():
        drawing.layers.add(name, color=colour)
    space = drawing.modelspace()
    for line in lines_of(plan):
        space.add_lwpolyline(line.points.round(4).tolist(), close=line.closed, dxfattribs={"layer": line.layer})
    for name, floor in plan.floors.items():
        at = shapely.Polygon(on_paper(floor)).representative_point()
        kind = plan.home.room(name).type
        for number, word in enumerate([name] if room_kind([name]) == kind else [name, kind.replace("_", " ")]):
            text = space.add_text(word, height=0.25, dxfattribs={"layer": "room"})
            text.set_placement((at.x, at.y - 0.3 * number))
    for thing in things:
        name = thing.node.category
        block = drawing.blocks.new(free_name(name, {one.name for one in drawing.blocks}))
        middle = on_paper(thing.corners).mean(0)
        block.add_lwpolyline((on_paper(thing.corners) - middle).round(4).tolist(), close=True)
        space.add_blockref(block.name, middle.round(4).tolist(), dxfattribs={"layer": "furniture"})
    for start, end, _ in dimensions_of(plan):
        angle = 90 if start[0] == end[0] else 0
        style = {"dimtxt": 0.25, "dimasz": 0.15, "dimexo": 0.0, "dimexe": 0.1}
        made = space.add_linear_dim(start, start, end, angle=angle, override=style, dxfattribs={"layer": "dimension"})
        made.render()
    with whole_file(path) as beside:
        drawing.saveas(beside)


LOOK = {"name": "PureWhite"}
ASSETS = {"door": "Doorway_1", "passage": "Doorframe_1", "window": "Window_Slider_48x36"}


def write_procthor(plan: HomePlan, path: Path) -> None:
    """Write the rooms, walls, doors and windows of a plan; furniture stays out, whose models AI2-THOR does not have.

    Walls of ProcTHOR have no thickness: rooms end in the middle of the walls between them. What it has no words for
    stands in `metadata`, from where `read_procthor` takes it.
    """
    number = {name: index + 2 for index, name in enumerate(plan.cells)}  # 1 is outside
    rooms, walls, ours = [], [], {"rooms": dict[str, Any](), "doors": dict[str, Any]()}
    for name, cell in plan.cells.items():
        spec = plan.home.room(name).graph.room
        corners = _in_unity(cell)
        ours["rooms"][f"room|{number[name]}"] = {"name": name, "type": spec.type, "walls": [*plan.walls[name]]}
        about = {"roomType": THOR.get(spec.type, "LivingRoom"), "floorPolygon": corners, "floorMaterial": LOOK}
        rooms.append({"id": f"room|{number[name]}", **about, "ceilings": [], "children": []})
        for edge, ends in enumerate(zip(corners, [*corners[1:], corners[0]], strict=True)):
            polygon = [*ends, *({**corner, "y": spec.tall} for corner in ends)]
            mine = {"id": f"wall|{number[name]}|{edge}", "roomId": f"room|{number[name]}"}
            walls.append({**mine, "material": LOOK, "polygon": polygon})
    found: dict[str, Any] = {"rooms": rooms, "walls": walls, "doors": [], "windows": [], "objects": []}
    inner = [(one, opening) for (one, _), opening in ways(plan)]
    outer = [
        (name, opening) for name in plan.floors for opening in plan.openings[name] if plan.behind(name, opening) is None
    ]
    for name, opening in (*inner, *outer):
        behind = plan.behind(name, opening)
        wall, room = f"wall|{number[name]}|{opening.edge}", f"room|{number[name]}"
        there = (f"wall|{number[behind[0]]}|{behind[1].edge}", f"room|{number[behind[0]]}") if behind else (wall, room)
        cell = plan.cells[name]
        at = (segment(plan.floors[name], opening) - cell[opening.edge]) @ direction(cell, opening.edge)
        low, high = {"y": opening.sill}, {"y": opening.sill + opening.height}
        kind = "window" if opening.kind == "window" else "door"
        one = {"id": f"{kind}|{number[name]}|{len(found[f'{kind}s'])}", "assetId": ASSETS[opening.kind]}
        one |= {"room0": room, "room1": there[1], "wall0": wall, "wall1": there[0]}
        middle = {"x": float(at.mean()), "y": opening.sill + opening.height / 2, "z": 0}
        hole = [{"x": float(np.round(x, 4)), **y, "z": 0} for x, y in zip(at, (low, high), strict=True)]
        found[f"{kind}s"].append({**one, "holePolygon": hole, "assetPosition": middle})
        if len(swing := swing_area(plan.floors[name], opening)):
            leaf = _in_unity(np.array([hinge_point(plan.floors[name], opening)[0], swing[-1]]))
            ours["doors"][one["id"]] = dict(zip(("hinge", "tip"), leaf, strict=True))
    found["proceduralParameters"] = {"ceilingMaterial": LOOK, "floorColliderThickness": 1.0, "lights": []}
    found["metadata"] = {"schema": "1.0.0", "generator": "echousd", "echousd": ours}
    write_json(path, found)


def _in_unity(points: np.ndarray) -> list[dict[str, float]]:
    """Points (x, z) of the home as Unity has them: its x is our east."""
    return [{"x": z, "y": 0, "z": x} for x, z in points.round(4).tolist()]
