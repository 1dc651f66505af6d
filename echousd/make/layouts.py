"""Boxes for a graph: sampled, equal within sets, placed; and the floor below."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from echomodel.boxes import Boxes
from echomodel.boxes2d import footprints
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.late import Late
from echomodel.loading import load_model
from echomodel.objective.access import LEAF, NEEDED
from echomodel.objective.physics import TOUCH
from echomodel.openings import Opening, signed_area
from echomodel.progress import StageTimer
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph
from echousd.graph.arrays import floor_centre, graph_batch, one_thread, rounded_boxes, seeded
from echousd.graph.floors import with_placed_openings
from echousd.make.verdicts import layout_outcome
from echousd.options import RoomOptions
from echousd.place.living import living_faults, severity
from echousd.place.placing import Arranged, PlacedBoxes
from echousd.place.placing import place as placed
from echousd.place.search import OF_GRAPHS
from echousd.place.solver import PlaceConfig
from echousd.shapes.styles import equal_sizes, style_groups, unequal_pairs

if TYPE_CHECKING:
    from echomodel.protocols import RoomModel

sentence = Late("echousd.place.conflicts:sentence")
DRAFTS = 8  # of which the best is kept
ROUNDS = (2, 5)  # further drafts that are drawn at once: most rooms need one or two
MARGIN = 0.35  # metres of floor around the furniture where nobody said how large the floor is
POSES = 12_000  # that are judged for one room, over all its drafts; the search that is begun then comes to its end
PIECE = 500  # the same in halls, for each piece
SHARE = 0.375  # of these in passing
ALIKE = 4  # drafts that end alike, after which no further one is drawn; fewer lost a clean room in 140
CROWD = 160  # objects of all drafts together, unless somebody says how many drafts
MAX_OBJECTS = 200  # of one room: up to here time grows no faster than their number, 400 take four times that of 200
TALL = 2.0  # metres by which a screen counts as higher where openings are placed: it wants no window behind it
DEFAULTS = PlaceConfig()
Found = tuple[Boxes, tuple[str, ...]]  # a layout, and what of its demands is in conflict
Stated = tuple[Opening, ...]
OF_WINDOWS = frozenset({"window_free"})  # terms
OF_OPENINGS = OF_WINDOWS | {"door_free", "leaf_aside", "way_in"}
DRAWN_LATER = 1_000_000  # added to the number of a layout, so that its further drafts are no other layout's
judged_faults = lru_cache(4 * DRAFTS)(living_faults)  # of boxes that nobody changes: openings that make way ask again


def check_objects(graph: SceneGraph, file: str = "") -> None:
    """Raises ValueError for more objects than a room may hold."""
    if len(graph.nodes) > MAX_OBJECTS:
        raise ValueError(f"{file or 'the graph'}: {len(graph.nodes)} objects, allowed in one room: {MAX_OBJECTS}")


def model_of(asked: RoomOptions, model: RoomModel | None) -> RoomModel:
    """A model that is given, else that of the option `weights`; raises ValueError for a path, as `load_model` does."""
    if isinstance(model, str | os.PathLike):
        raise ValueError(f"model is {str(model)!r}, allowed: a loaded model; a file goes to weights")
    return load_model(asked.weights, device=asked.device) if model is None else model


@dataclass(frozen=True, eq=False)
class LayoutSearch:
    """How the layouts of a room are found: drafts of a model, of which a search makes the best that it can."""

    model: RoomModel
    seed: int  # of the draws; equal ones, and equal numbers and counts, give equal drafts
    timer: StageTimer
    steps: int | None = None  # of the sampler, None = the model's own
    change: GraphEdit | None = None  # what was edited in the graph, None = nothing
    drafts: int = 1  # at most
    place: bool = True  # whether drafts are placed by search
    proposed: bool = False  # nobody stated some of the openings, which make way for furniture
    stated: Stated = ()  # those that stay then

    def sampled(self, graph: SceneGraph, number: int, count: int = 1) -> list[Boxes]:
        """So many drafts at once from the layout branch, in the room's frame; what the graph fixes comes back."""
        centre, nodes = floor_centre(graph), graph.nodes
        batch = GraphBatch.pack([graph_batch(graph)] * count)
        known_nodes = np.array([None not in (n.size, n.position, n.yaw) for n in nodes] * count)
        known = Boxes.cat([Boxes(
            np.array([n.size or (1.0, 1.0, 1.0) for n in nodes], np.float32),
            np.array([n.position or (0.0, 0.0, 0.0) for n in nodes], np.float32) - centre,
            np.array([n.yaw or 0.0 for n in nodes], np.float32),
        )] * count)  # fmt: skip
        extra: dict[str, Any] = {"known": known, "known_mask": known_nodes} if known_nodes.any() else {}
        if self.steps is not None:
            extra["steps"] = self.steps
        if self.place and isinstance(self.model, EchoModel):
            extra["relation_guidance"] = 0.0  # where boxes are placed by search afterwards guidance changes nothing
        if self.change is not None:
            extra["edit"] = self.change.repeated(count)
        generator = seeded(self.seed, "layout", number)
        with self.timer.stage("layout") as tell, one_thread():
            drawn = not known_nodes.all()  # else nothing is left to draw
            draw = self.model.sample_layout
            found = draw(batch, generator=generator, progress=tell, **extra).to(None) if drawn else known
        return [
            rounded_boxes(graph, Boxes(found.size[rows], found.position[rows] + centre, found.yaw[rows]))
            for rows in np.arange(count * len(nodes)).reshape(count, -1)
        ]

    def best(self, graph: SceneGraph, number: int = 0) -> tuple[Boxes, tuple[str, ...]]:
        """The best of several drafts after place: kept relations first, then collisions, then the living rules.

        Further drafts are drawn, a few at once, only where those before leave something to be wished for. Each is
        searched in passing; what is left then is searched for in earnest, the best first and one of those that ended
        alike, until the room's `POSES` are judged.

        `number`: of the layout.
        """
        best: Found | None = None
        worth: tuple[float, ...] = ()
        ways, judged = [(graph, DEFAULTS)], 0
        budget = max(POSES, PIECE * len(graph.nodes)) * max(1.0, self.drafts / DRAFTS)
        # what a draft leaves to be wished for, its number, it, and the searches that were begun from it
        left: list[tuple[tuple[float, ...], int, Boxes, dict[bytes, Arranged]]] = []
        if self.proposed and graph.room.openings:  # which make way for the furniture of every other draft
            bare = graph.with_room(openings=self.stated)
            yields = OF_WINDOWS if self.stated else OF_OPENINGS
            ways = [(graph, PlaceConfig(yields=yields)), (bare, DEFAULTS)]

        def drawn() -> Iterator[tuple[int, Boxes, dict[bytes, Arranged], int]]:
            for start, count in draft_rounds(self.drafts):
                for draft in self.sampled(graph, number + start, count) if judged < budget * SHARE else ():
                    ends = [wishes for wishes, *_ in left]
                    if judged < budget * SHARE and max(map(ends.count, ends), default=0) < ALIKE:
                        yield len(left), draft, {}, 0 if self.drafts > 1 else DEFAULTS.anew
            for _, rank, draft, begun in sorted({one[0]: one for one in left[::-1]}.values(), key=lambda one: one[0]):
                yield rank, draft, begun, DEFAULTS.anew

        for rank, draft, begun, anew in drawn():
            room, config = ways[rank % len(ways)]
            found, poses = finished_boxes(room, draft, self.place, self.timer, replace(config, anew=anew), begun)
            if self.drafts == 1 or not self.place:
                return found
            judged += poses
            with self.timer.stage("place"), one_thread():
                wishes = _wishes(graph, found, self.seed if self.proposed else None, self.stated)
            if best is None or wishes < worth:
                best, worth = found, wishes
            left += [] if anew else [(wishes, rank, draft, begun)]
            if not any(worth) or (anew and judged > budget):
                break
        assert best is not None
        return best


def most_drafts(model: RoomModel, objects: int) -> int:
    """How many drafts a model draws at most where nobody says it: fewer of very many objects, which take long enough.

    The published models take a thousand steps for one.
    """
    return max(1, min(DRAFTS, CROWD // max(objects, 1))) if model.preset == "compact" else 1


def draft_rounds(drafts: int) -> list[tuple[int, int]]:
    """What is added to the number of the draws, and how many are drawn at once, until all drafts are drawn."""
    out, left = [(0, 1)], drafts - 1
    for count in (*ROUNDS, drafts):
        if left > 0:
            out.append((len(out) * DRAWN_LATER, min(count, left)))
            left -= count
    return out


def _wishes(graph: SceneGraph, found: Found, seed: int | None, stated: Stated = ()) -> tuple[float, ...]:
    """What a layout leaves to be wished for, the worse first: what is broken or collides, conflicts, rounded faults
    that another layout may not have.

    `seed`: that by which openings make way which are not among the `stated`; None = they stay.
    """
    boxes, conflicts = found
    faults = judged_faults(graph, boxes)
    if seed is not None and any(fault.rule in OF_OPENINGS for fault in faults):
        faults = judged_faults(with_free_openings(graph, [boxes], seed, stated), boxes)
    left = [fault for fault in faults if fault.rule not in OF_GRAPHS]
    return len(layout_outcome(graph, boxes).faults), len(conflicts), round(severity(left), 2)


def finished_boxes(
    graph: SceneGraph, boxes: Boxes, place: bool, timer: StageTimer, config: PlaceConfig = DEFAULTS,
    begun: dict[bytes, Arranged] | None = None,
) -> tuple[tuple[Boxes, tuple[str, ...]], int]:  # fmt: skip
    """Sampled boxes, of equal sizes within style groups, placed if wanted, and demands in conflict; poses judged."""
    styles = style_groups(graph)
    boxes = _alike(graph, _mounted(graph, boxes.to(None)), styles)
    if not place:
        return (rounded_boxes(graph, boxes), ()), 0

    @cache
    def wrong(one: PlacedBoxes) -> tuple[float, ...]:
        return int((one.verdict == 0).sum()), len(one.collisions), severity(living_faults(graph, one.boxes))

    # what is locked without having a place may be placed
    graph = graph.replaced(nodes=tuple(n.replaced(locked=n.locked and n.position is not None) for n in graph.nodes))
    with timer.stage("place"), one_thread():
        found = placed(graph, boxes, config=config, begun=begun)
        judged = found.judged
        same = _alike(graph, found.boxes, styles)
        if not np.array_equal(same.size, found.boxes.size):
            # chairs of one set that had to shrink: all of them, if it fits; else at other places
            sized = zip(graph.nodes, map(tuple, same.size.tolist()), strict=True)
            fixed = graph.replaced(nodes=tuple(node.replaced(size=size) for node, size in sized))
            second = placed(fixed, same, config=replace(config, arrange=False))
            if wrong(second) > wrong(found):
                third = placed(fixed, same, config=config, begun=begun)
                judged, second = judged + third.judged, min(second, third, key=wrong)
            if wrong(second)[:2] <= wrong(found)[:2]:
                found = second
    boxes = rounded_boxes(graph, _on_cords(graph, found.boxes, styles))
    return (boxes, tuple(sentence(one, graph) for one in found.conflicts)), judged


def _on_cords(graph: SceneGraph, boxes: Boxes, styles: Mapping[str, str]) -> Boxes:
    """The boxes with lamps that had to come down from the ceiling, to be near something, on cords as much longer."""
    lamps = np.array([vocabulary().category(node.category).support == "ceiling" for node in graph.nodes], bool)
    free = [None is node.size is node.position and not node.locked for node in graph.nodes]
    size, position, tall = boxes.size.copy(), boxes.position.copy(), graph.room.tall
    low = lamps & free & (position[:, 1] + size[:, 1] < tall - TOUCH)
    if not low.any():
        return boxes
    size[low, 1] = tall - position[low, 1]
    lamps &= free
    size[lamps] = _alike(graph, Boxes(size, position, boxes.yaw), styles).size[lamps]
    position[lamps, 1] = tall - size[lamps, 1]
    longer = Boxes(size, position, boxes.yaw)
    worse = len(layout_outcome(graph, longer).faults) > len(layout_outcome(graph, boxes).faults)
    return boxes if worse else longer


def with_free_openings(graph: SceneGraph, layouts: Sequence[Boxes], seed: int, stated: Stated = ()) -> SceneGraph:
    """The graph with openings that nobody stated moved to where nothing stands, if furniture is in their way.

    A screen wants no window behind it.
    """

    def faults(graph: SceneGraph) -> int:
        return sum(len(judged_faults(graph, boxes)) for boxes in layouts)

    bare = graph.with_room(openings=stated)
    before = faults(graph)
    if graph.room.openings and (not before or before <= faults(bare)):
        return graph
    moved = with_placed_openings(bare, _obstacles(graph, layouts), seed)
    return moved if not graph.room.openings or faults(moved) < before else graph


def _obstacles(graph: SceneGraph, layouts: Sequence[Boxes]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What openings keep off, as `plan_boxes`: all boxes, screens higher, and flat ones where storage is opened."""
    kinds = [vocabulary().category(node.category) for node in graph.nodes] * len(layouts)
    size, position, yaw = plan_boxes(layouts)
    size[[kind.role == "screen" or kind.stands == "opposite" for kind in kinds], 1] += TALL
    opens = [k for k, kind in enumerate(kinds) if kind.role == "storage" and kind.support == "floor" and kind.access]
    depth = NEEDED * np.array([kinds[k].access for k in opens])
    before = np.stack([size[opens, 0] * (1 - 2 * LEAF), np.full(len(opens), 0.1), depth], 1)
    front = np.stack([np.sin(yaw[opens]), np.zeros(len(opens)), np.cos(yaw[opens])], 1)
    at = position[opens] + front * (size[opens, 2] + depth)[:, None] / 2
    return np.concatenate([size, before]), np.concatenate([position, at]), np.concatenate([yaw, yaw[opens]])


def room_floor(graph: SceneGraph, layouts: Sequence[Boxes]) -> np.ndarray:
    """(k, 2) float: corners of the floor, counter-clockwise seen from above (x to the right, z towards the viewer).

    They are those of the graph's polygon, of its size around the origin, or of what stands there in any layout.
    """
    room = graph.room
    if room.floor_polygon is not None:
        corners = np.asarray(shapely.Polygon(room.floor_polygon).exterior.coords)[:-1]
    else:
        plan = footprints(*plan_boxes(layouts)).reshape(-1, 2)
        low, high = plan.min(0) - MARGIN, plan.max(0) + MARGIN
        if room.size is not None:
            low, high = -np.asarray(room.size) / 2, np.asarray(room.size) / 2
        corners = np.array([(low[0], low[1]), (low[0], high[1]), (high[0], high[1]), (high[0], low[1])])
    return corners if signed_area(corners) < 0 else corners[::-1].copy()


def plan_boxes(layouts: Sequence[Boxes]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size and position (n, 3), metres, and yaw (n,), radians, of the boxes of all layouts behind one another."""
    size, position, yaw = (
        np.concatenate([np.asarray(getattr(boxes, name), float) for boxes in layouts])
        for name in ("size", "position", "yaw")
    )
    return size, position, yaw


def _mounted(graph: SceneGraph, boxes: Boxes) -> Boxes:
    """The boxes with what is fixed to a wall at the height where such things hang, unless its place is stated."""
    position = boxes.position.copy()
    for number, node in enumerate(graph.nodes):
        row = vocabulary().category(node.category)
        if row.mounted and node.position is None:
            position[number, 1] = row.mounted
    return Boxes(boxes.size, position, boxes.yaw)


def _alike(graph: SceneGraph, boxes: Boxes, styles: Mapping[str, str]) -> Boxes:
    names, categories = [n.name for n in graph.nodes], [n.category for n in graph.nodes]
    cut = [vocabulary().category(word).stands in ("row", "over") for word in categories]  # to the length there is
    free = np.array([node.size is None and not node.locked for node in graph.nodes]) & ~np.array(cut, bool)
    size = equal_sizes(names, categories, styles, np.asarray(boxes.size, float), free, unequal_pairs(graph))
    return Boxes(size.astype(np.float32), boxes.position, boxes.yaw)
