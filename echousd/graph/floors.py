"""Floors and openings of graphs that state none, and floors that cannot hold their furniture."""

from dataclasses import replace
from typing import Any

import numpy as np

from echomodel.boxes2d import footprints
from echomodel.openings import STEP, WINDOW_DEPTH, WINDOWS, Opening, signed_area, sliding, swing_area, zone
from echomodel.sizes import footprint, size_statistics
from echomodel.vocabulary import vocabulary
from echousd.graph.consistency import GraphError
from echousd.graph.nodes import HEIGHT
from echousd.graph.scene import SceneGraph

LARGEST = 10_000.0  # m² of the box around a floor; what is rasterized on it takes 0.1 MB for each
SLIDING = 0.08  # share of rooms without a style whose door slides, where there is room for it
FRENCH, TALL = 0.15, 0.15  # likewise, whose windows reach down to the floor, or nearly
LOW = 0.3  # metres, sill of tall windows
OUTER = 0.15  # metres: thicker walls have the outside behind them
CROWDED = 0.62  # share of the floor, from which on a person is told
Arrays = tuple[np.ndarray, np.ndarray, np.ndarray]


def with_plan(graph: SceneGraph, seed: int) -> SceneGraph:
    """The graph with the floor, the door and the windows that such a room would have, where it states none.

    The layout is drawn for what comes back: doors then swing free and windows give light.
    """
    return with_placed_openings(with_floor(graph, seed), _fixed(graph), seed)


def with_floor(graph: SceneGraph, seed: int) -> SceneGraph:
    """The graph with the floor that such a room would have, where it states none and is no arrangement of others.

    The same seed and graph give the same floor. More objects in a row to the left and right than to the front and
    behind make the room wider than deep. Some floors are L-shaped, as real ones are, where no opening counts walls and
    no object's place is stated; those that are stand on it, though its middle has to move.
    """
    if graph.room.extents is not None or any(node.locked and node.asset for node in graph.nodes):
        return graph
    from echomodel.plans import floor_extents, floor_outline, longest_side

    predicates = [relation.predicate for relation in graph.relations]
    aside = sum(predicate in ("left", "right") for predicate in predicates)
    ahead = sum(predicate in ("front", "behind") for predicate in predicates)
    furniture = [node.category for node in graph.nodes], [node.size for node in graph.nodes]
    share, rng = (1 + ahead) / (2 + ahead + aside), _generator(seed, "floor")
    extents = floor_extents(graph.room.type, *furniture, rng, along_x=share, openings=graph.room.openings)
    cut, there = None, footprints(*_fixed(graph)).reshape(-1, 2)
    if len(there):
        sides = np.maximum(extents, np.ceil(10 * np.ptp(there, axis=0)) / 10)
        low = np.clip(-sides / 2, there.max(0) - sides, there.min(0)).round(3)
        return graph.with_room(**rectangle(low, low + sides))
    if not graph.room.openings:
        cut = floor_outline(graph.room.type, extents, longest_side(*furniture), _generator(seed, "outline"))
    if cut is None:
        return graph.with_room(size=extents)
    return graph.with_room(floor_polygon=tuple(map(tuple, cut.tolist())))


def rectangle(low: np.ndarray, high: np.ndarray) -> dict[str, Any]:
    """The fields of a room whose floor reaches from one corner (x, z) to the other, metres."""
    if np.allclose(low, -high):
        return {"size": tuple((high - low).tolist()), "floor_polygon": None}
    (x, z), (right, ahead) = low.tolist(), high.tolist()
    return {"size": None, "floor_polygon": ((x, z), (right, z), (right, ahead), (x, ahead))}


def with_placed_openings(graph: SceneGraph, boxes: Arrays, seed: int) -> SceneGraph:
    """The graph with a door where it states no opening, and windows where it states none, placed where nothing stands.

    Windows are above worktops in every room that has fitted units.

    Arguments:
        graph: with a floor; without one it comes back as it is.
        boxes: size (n, 3), position (n, 3) of the bottom centre, metres, and yaw (n,), of all that stands already.
        seed: decides between places that are equally good.
    """
    from echomodel.rooms.openings import place_openings

    corners = graph.room.corners
    if corners is None or any(opening.kind == "window" for opening in graph.room.openings):
        return graph
    words = vocabulary()
    fitted = any(words.category(node.category).stands == "row" for node in graph.nodes)
    use = "wet" if fitted else words.room_type(graph.room.type).use
    outer = [(edge, 0.0, np.inf) for edge, thick in enumerate(graph.room.walls) if thick > OUTER]
    placed = place_openings(
        corners, graph.room.tall, _generator(seed, "openings"), boxes=boxes, stated=graph.room.openings,
        use=use if use in WINDOWS else "", spans=outer if graph.room.walls else None,
    )  # fmt: skip
    share = style.sliding if (style := words.known_style(graph.room.style)) else SLIDING
    if not use and not len(boxes[0]) and _generator(seed, "sliding").random() < share:
        placed = tuple(one if one in graph.room.openings else sliding(corners, one, placed) for one in placed)
    return graph.with_room(openings=placed)


def with_lowered_windows(graph: SceneGraph, stated: SceneGraph, boxes: Arrays, seed: int) -> SceneGraph:
    """The graph with French or tall windows, by its style, instead of those that nobody stated and nothing is before.

    `stated`: the graph before openings were proposed. `boxes`: of all that stands there, as of `with_placed_openings`.
    """
    import shapely

    corners, words, draw = graph.room.corners, vocabulary(), _generator(seed, "windows").random()
    style = words.known_style(graph.room.style)
    french, tall = (style.french, style.tall) if style else (FRENCH, TALL)
    wanted = [(0.0, STEP)] * (draw < french) + [(LOW, WINDOW_DEPTH)] * (draw < french + tall)  # sills, and free before
    if corners is None or not wanted or words.room_type(graph.room.type).use:
        return graph
    plans, (size, position, _) = shapely.polygons(footprints(*boxes)), boxes

    def lowered(one: Opening) -> Opening:
        for sill, deep in wanted if one.kind == "window" and one not in stated.room.openings else ():
            before = shapely.intersects(plans, shapely.Polygon(zone(corners, one, deep)))
            if sill < one.sill and not (before & (position[:, 1] + size[:, 1] > sill)).any():
                return replace(one, sill=sill, height=round(one.height + one.sill - sill, 4))
        return one

    return graph.with_room(openings=tuple(map(lowered, graph.room.openings)))


def _fixed(graph: SceneGraph) -> Arrays:
    """Size, position and yaw of the objects whose place is stated: of usual size, and as deep as wide, where no size
    or no yaw is."""
    nodes = [node for node in graph.nodes if node.position is not None]
    size = np.array([node.size or size_statistics(node.category).median for node in nodes]).reshape(-1, 3)
    turned = np.array([node.yaw is None for node in nodes], bool)
    size[turned, ::2] = size[turned, ::2].max(1, keepdims=True)
    position = np.array([node.position for node in nodes], float).reshape(-1, 3)
    return size, position, np.array([node.yaw or 0.0 for node in nodes], float)


def check_extents(extents: tuple[float, float] | None) -> None:
    """Raises `GraphError` for a floor on which a room would take gigabytes.

    Arguments:
        extents: (x, z) of its bounding box, metres; None where nothing is known.
    """
    if extents is not None and not extents[0] * extents[1] <= LARGEST:
        raise GraphError(
            f"the floor of {extents[0]:.6g} x {extents[1]:.6g} m is too large, allowed: {LARGEST:.0f} m² around it",
            ("room",),
        )


def check_space(graph: SceneGraph) -> tuple[str, ...]:
    """A sentence where the furniture leaves hardly a way through the floor that is stated.

    Raises `GraphError` for a floor that is too large, and where the furniture cannot fit: its least footprint covers
    more than the floor, or one piece of a stated size is longer than the room.
    """
    corners, extents = graph.room.corners, graph.room.extents
    if corners is None or extents is None:
        return ()
    check_extents(extents)

    area = abs(signed_area(corners))
    space = f"the floor of {extents[0]:.2f} x {extents[1]:.2f} m ({area:.1f} m²)"
    diagonal = float(np.hypot(*extents))
    for node in graph.nodes:
        if node.size and max(node.size[0], node.size[2]) > diagonal:
            raise GraphError(
                f"{space} is too small for {node.name!r}, which is {max(node.size[0], node.size[2]):.2f} m long; "
                f"allowed: up to {diagonal:.2f} m, corner to corner",
                ("room",),
            )
    categories, sizes = [n.category for n in graph.nodes], [n.size for n in graph.nodes]
    least = footprint(categories, sizes, least=True)
    if least > area:
        raise GraphError(
            f"{space} is too small for its furniture, which covers at least {least:.1f} m²; allowed: a larger floor, "
            "fewer or smaller objects",
            ("room",),
        )
    usual = footprint(categories, sizes)
    if usual > CROWDED * area:
        return (f"{space} is small for furniture that covers about {usual:.1f} m²: expect tight ways",)
    return ()


def _generator(seed: int, what: str) -> np.random.Generator:
    return np.random.default_rng([seed, *what.encode()])


ALLOWED = 1e-3  # square metres of a swing that a locked object may touch
QUARTERS = (0.0, np.pi / 2)  # headings that a locked object may get which states none


def check_doors(graph: SceneGraph) -> None:
    """Raise `GraphError` for an opening that is higher than the walls of a room that states no height, and for a door
    that opens into a locked object whose size and position are stated.

    Of one that states no yaw it must be in the way however that is turned, by quarter turns.
    """
    for number, opening in enumerate(graph.room.openings):
        top = opening.sill + opening.height
        if graph.room.height is None and top > HEIGHT:
            raise GraphError(
                f"{opening.kind} {opening.name!r}: its top is at {top:.2f} m, allowed: up to {HEIGHT:.2f} m, "
                "the height of rooms that state none",
                ("room", "openings", number),
            )
    corners = graph.room.corners
    fixed = [n for n in graph.nodes if n.locked and n.size and n.position]
    if corners is None or not fixed:
        return
    import shapely

    for number, opening in enumerate(graph.room.openings):
        swept = swing_area(corners, opening)
        if not len(swept):
            continue
        area = shapely.Polygon(swept)
        for node in fixed:
            assert node.size is not None
            assert node.position is not None
            if node.position[1] > opening.height:
                continue
            yaws = QUARTERS if node.yaw is None else (node.yaw,)
            plans = footprints(np.array([node.size] * len(yaws)), np.array([node.position] * len(yaws)), np.array(yaws))
            met = min(area.intersection(shapely.Polygon(plan)).area for plan in plans)
            if met > ALLOWED:
                raise GraphError(
                    f"door {opening.name!r} opens into the locked object {node.name!r} "
                    f"({met:.2f} m² of its swing), "
                    "allowed: a free swing; move one of them, or let the door swing out",
                    ("room", "openings", number),
                )
