"""Plans that are there already: rooms whose floors are stated side by side, drawn by hand or planned before."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel.openings import Opening, direction, numbered
from echousd.graph import SceneGraph
from echousd.home.graph import HomeGraph, HomeRelation
from echousd.home.openings import Floor, face_to_face, facings
from echousd.home.plan import INNER, OUTER, HomePlan, overlapping, plan_home, with_openings
from echousd.naming import STAGE_FORMS
from echousd.shapes.walls import outline as offset

THICKEST = 0.6  # metres between two floors that have one wall between them
APART = 0.05  # square metres that floors of different rooms may share by rounding
Placed = Mapping[str, tuple[SceneGraph, np.ndarray]]  # graph of every room, and its pose in the home


def next_plan(home: HomeGraph, *, seed: int = 0, before: Path | None = None) -> HomePlan:
    """The plan of a home of which one may be there already; raises `GraphError`.

    Arguments:
        before: layer of that home: its plan stays where nothing is asked but what stands in its rooms, its floors where
            they do for other relations, and else it is begun with.
    """
    old = plan_there(before) if before is not None and before.is_file() else None
    home = home.connected()
    if old is not None and _asks(old.home) == _asks(home):
        if old.home.relations == home.relations:
            return replace(old, home=home)
        if not (plan := with_openings(replace(old, home=home), old.home)).broken():
            return plan
    return plan_home(home, seed=seed, before=old)


def _asks(home: HomeGraph) -> tuple[object, ...]:
    """What a home asks of its plan besides relations."""
    rooms = tuple((room.name, room.type, room.area, room.ratio) for room in home.rooms)
    return rooms, home.area, home.outline, home.entrance


def plan_there(path: Path, home: HomeGraph | None = None) -> HomePlan | None:
    """The plan on a stage, None where its rooms state no floors or floors in one place."""
    if path.suffix.lower() not in STAGE_FORMS:
        if home is None or any(room.graph.room.floor_polygon is None for room in home.rooms):
            return None
        return placed_plan(home, {room.name: (room.graph, np.eye(4)) for room in home.rooms})  # corners as in the home
    from echousd.home.files import load_home
    from echousd.home.stages import read_poses

    home = home or load_home(path)
    return None if home is None else placed_plan(home, read_poses(path))


def placed_plan(home: HomeGraph, rooms: Placed) -> HomePlan | None:
    """The plan that rooms with floors and poses make together, None where a floor is missing or stands in another's.

    A door in one of them is a hole in the other; where none is stated, there are those that the graph asks for.
    """
    plan = walled(home, rooms)
    if plan is None:
        return None
    stated = {
        name: _moved(graph.room.openings, _placed(graph, pose), plan.floors[name])
        for name, (graph, pose) in rooms.items()
    }
    if not any(stated.values()):
        return with_openings(replace(plan, home=_reached(plan)))
    return replace(plan, openings=_shared(plan, stated))


def _placed(graph: SceneGraph, pose: np.ndarray) -> np.ndarray:
    """(k, 2) float, the floor of a room in the home's frame, as stated."""
    return graph.room.corners @ pose[[0, 2]][:, [0, 2]].T + pose[[0, 2], 3]


def walled(home: HomeGraph, rooms: Placed) -> HomePlan | None:
    """The floors of rooms and the walls between them, without openings; as `placed_plan`.

    Floors that meet are taken to end in the middle of their wall and lose half of it.
    """
    corners = {}
    for name, (graph, pose) in rooms.items():
        if graph.room.corners is None:
            return None
        corners[name] = _placed(graph, pose)
    if any(overlapping(corners, APART)):
        return None
    if all(graph.room.walls for graph, _ in rooms.values()):
        walls = {name: graph.room.walls for name, (graph, _) in rooms.items()}
        floors, insets = corners, {name: np.zeros(len(floor)) for name, floor in corners.items()}
    else:
        insets, walls = {}, {}
        sides = [Floor(name, floor, ()) for name, floor in corners.items()]
        for one in sides:
            gap = np.full(len(one.corners), np.inf)
            for stretch in (each for other in sides if other is not one for each in face_to_face(one, other)):
                if -0.02 < stretch.deep < THICKEST:
                    gap[stretch.edge] = min(gap[stretch.edge], max(stretch.deep, 0.0))
            meets, met = gap < INNER / 2, np.isfinite(gap)
            insets[one.name] = np.where(meets, INNER / 2, 0.0)
            walls[one.name] = tuple(np.select([meets, met], [INNER / 2, (gap / 2).round(4)], OUTER).tolist())
        floors = {name: offset(floor, -insets[name]).round(4) for name, floor in corners.items()}
    cells = {name: offset(floor, walls[name]).round(4) for name, floor in floors.items()}
    low = np.concatenate([*cells.values()]).min(0)
    lie = {name: (*(cell - low).min(0), *(cell - low).max(0)) for name, cell in cells.items() if len(cell) == 4}
    poses = {name: pose for name, (_, pose) in rooms.items()}
    return HomePlan(home, cells, walls, {name: () for name in cells}, lie, poses)


def _moved(openings: tuple[Opening, ...], before: np.ndarray, after: np.ndarray) -> tuple[Opening, ...]:
    """Openings of a floor whose edges were moved inwards, where they were in the home."""

    def offset_of(one: Opening) -> float:
        shift = (before[one.edge] - after[one.edge]) @ direction(before, one.edge)
        return max(round(one.offset + float(shift), 4), 0.0)

    return tuple(replace(one, offset=offset_of(one)) for one in openings)


def _shared(plan: HomePlan, stated: Mapping[str, tuple[Opening, ...]]) -> dict[str, tuple[Opening, ...]]:
    """The openings of all rooms with both sides of each: the leaf in the room that states the door first."""
    found = {name: list(openings) for name, openings in stated.items()}
    for name in list(found):
        for opening in list(found[name]):
            behind = plan.behind(name, opening) if opening in found[name] else None
            if behind is None or opening.kind == "window":
                continue
            other, hole = behind
            same = [
                o
                for o in found[other]
                if o.edge == hole.edge and min(o.end, hole.end) - max(o.offset, hole.offset) > hole.width / 2
            ]
            if same and same[0].kind == "door" and opening.kind != "door":
                continue
            taken = [o.name for o in found[other] if o not in same]
            kept = replace(hole, name=same[0].name if same else numbered(opening.kind, taken))
            found[other] = [kept if same and o is same[0] else o for o in found[other]] + ([] if same else [kept])
    return {name: tuple(openings) for name, openings in found.items()}


def _reached(plan: HomePlan) -> HomeGraph:
    """The graph with doors to rooms that share a wall with those one gets to, where it leads nowhere."""
    home, floors = plan.home, plan.sides
    order = sorted(floors, key=home.serves, reverse=True)
    reached = [home.entered_by]
    while len(reached) < len(floors):
        passages = home.passages
        near = [(a, b) for a in order if a in reached for b in order if b not in reached]
        way = next((pair for pair in near if passages.has_edge(*pair)), None)
        way = way or next(
            (pair for pair in near if any(f.high - f.low > 1.2 for f in facings(floors[pair[0]], floors[pair[1]]))),
            None,
        )
        if way is None:
            break
        if not passages.has_edge(*way):
            home = home.replaced(relations=(*home.relations, HomeRelation(way[0], "door", way[1])))
        reached.append(way[1])
    return home
