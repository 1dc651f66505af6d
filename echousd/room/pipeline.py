"""From a graph to a room: sample boxes, repair them, sample shapes, clean meshes, decide what shares an asset."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
import trimesh

from echomodel.boxes import Boxes
from echomodel.graph import GraphBatch
from echomodel.rules import margins, verdicts
from echomodel.vocabulary import vocabulary
from echousd.graph import SceneGraph
from echousd.room.meshing import FACES, box_mesh, mesh_from_shape
from echousd.room.reproducible import one_thread, rounded_boxes, rounded_grids
from echousd.room.room import Provenance, Room, RoomOptions, Verdict
from echousd.room.shell import box_corners, floor_polygon
from echousd.room.styles import asset_names, equal_sizes, shared_assets, style_groups

if TYPE_CHECKING:
    from echomodel.echo import EchoModel, GraphEdit
    from echomodel.released.echo import ReleasedEcho

    Echo = EchoModel | ReleasedEcho

Progress = Callable[[str, int, int], None]
SHAPES = ("generate", "boxes")
PRESETS = ("compact", "paper", "released")
STATES = {1: "kept", 0: "broken", -1: "unmeasured"}


@dataclass
class Watch:
    """Measures the stages of one run and tells a listener how far each is."""

    listener: Progress | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str, total: int = 1) -> Iterator[Callable[[int, int], None]]:
        """Time a stage; what it yields takes (done, total)."""
        started = time.perf_counter()
        self.tell(name, 0, total)
        yield lambda done, of: self.tell(name, done, of)
        self.tell(name, total, total)
        self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - started

    def tell(self, name: str, done: int, total: int) -> None:
        """Pass on how far a stage is."""
        if self.listener is not None:
            self.listener(name, done, total)


def generate(
    graph: SceneGraph | str | Path,
    *,
    seed: int = 0,
    shapes: str = "generate",
    model: Echo | str | Path | None = None,
    preset: str | None = None,
    repair: bool = True,
    samples: int = 1,
    steps: int | None = None,
    faces: int = FACES,
    options: RoomOptions | None = None,
    progress: Progress | None = None,
) -> Room:
    """Make a room from a scene graph.

    Arguments:
        graph: the graph, or a file that holds one (stage, YAML, JSON).
        seed: of all randomness, 0 or more; equal arguments give equal rooms.
        shapes: `generate` meshes with the shape branch, or plain `boxes`.
        model: a loaded model, a weights file (one of `echousd convert`, too), or None for the weights that ship with
            the package.
        preset: which kind of model it must be (`PRESETS`); None = any.
        repair: move and size the sampled boxes as little as possible until the graph is kept.
        samples: number of layouts of the same furniture.
        steps: sampling steps, None for the model's own.
        faces: face budget of each mesh.
        options: how the room is written.
        progress: called with (stage, done, total).

    Raises:
        ValueError: an argument that is not allowed, a graph that cannot be read or contradicts itself, weights that are
            missing, damaged or have no shape branch.
    """
    if shapes not in SHAPES:
        raise ValueError(f"shapes is {shapes!r}, allowed: {', '.join(SHAPES)}")
    if samples < 1 or samples > 1000:
        raise ValueError(f"samples is {samples}, allowed: 1 to 1000")
    if seed < 0:
        raise ValueError(f"seed is {seed}, allowed: 0 or more")
    check_preset(model, preset)
    watch = Watch(progress)
    source = ""
    if not isinstance(graph, SceneGraph):
        from echousd.graph import load_graph

        source = Path(graph).name
        with watch.stage("read"):
            graph = load_graph(graph)
    with watch.stage("load"):
        echo = load_model(model, preset)
        if shapes == "generate":
            require_shapes(echo)
    layouts = [sample_boxes(echo, graph, seed=seed, number=0, steps=steps, watch=watch)]
    layouts[0], notes = settled(graph, layouts[0], repair, watch)
    sized = with_sizes(graph, layouts[0])
    for number in range(1, samples):
        found = sample_boxes(echo, graph, seed=seed, number=number, steps=steps, watch=watch)
        found = Boxes(layouts[0].size, found.position, found.yaw)
        layouts.append(settled(sized, found, repair, watch)[0])
    boxes = layouts[0]
    grids = sample_shapes(echo, graph, boxes, seed=seed, steps=steps, watch=watch) if shapes == "generate" else None
    meshes, assets = make_meshes(graph, boxes, grids, faces=faces, watch=watch)
    return Room(
        name=graph.room.type,
        graph=graph,
        boxes=boxes,
        meshes=meshes,
        assets=assets,
        floor=room_floor(graph, layouts),
        verdicts=judge(graph, boxes),
        layouts=tuple(layouts),
        notes=notes,
        provenance=Provenance(seed, preset_of(echo), getattr(echo, "hash", ""), shapes, source),
        options=options or RoomOptions(),
        timings=watch.seconds,
    )


def load_model(model: Echo | str | Path | None, preset: str | None = None) -> Echo:
    """The model itself, or the one in a weights file (None: shipped), of the kind that the file says it is.

    Raises ValueError where there is none, or one of another preset than `preset`.
    """
    check_preset(model, preset)
    from echomodel.checkpoint import is_released

    if model is not None and not isinstance(model, str | Path):
        echo = model
    elif model is not None and is_released(model):
        from echomodel.released.echo import ReleasedEcho

        echo = ReleasedEcho.load(model)
    else:
        from echomodel.echo import EchoModel

        echo = EchoModel.load(model)
    if preset not in (None, preset_of(echo)):
        raise ValueError(f"{model}: holds a model of the preset {preset_of(echo)!r}, asked for: {preset!r}")
    return echo


def check_preset(model: Echo | str | Path | None, preset: str | None) -> None:
    """Raises ValueError for an unknown preset, or one without weights of its own where none are given."""
    if preset not in (None, *PRESETS):
        raise ValueError(f"preset is {preset!r}, allowed: {', '.join(PRESETS)}")
    if model is None and preset not in (None, "compact"):
        how = "train it" if preset == "paper" else "convert a published checkpoint (echousd convert)"
        raise ValueError(f"no weights ship for the preset {preset!r}: {how} and name the file (--weights FILE)")


def preset_of(echo: Echo) -> str:
    """Name of a model's preset."""
    return getattr(echo, "preset", "compact")


def require_shapes(echo: Echo) -> None:
    """Raises ValueError for a model without a shape branch."""
    if getattr(echo, "sample_shapes", None) is None or not getattr(echo, "has_shapes", True):
        raise ValueError("these weights have no shape branch; use shapes 'boxes' (--shapes boxes) or other weights")


def graph_batch(graph: SceneGraph) -> GraphBatch:
    """The graph as tensors; relations in their order."""
    words = vocabulary()
    index = {node.name: i for i, node in enumerate(graph.nodes)}
    return GraphBatch.single(
        [words.category_id(node.category) for node in graph.nodes],
        [(index[r.subject], words.predicate_id(r.predicate), index[r.object]) for r in graph.relations],
        room_type=words.room_type_id(graph.room.type),
        floor=graph.room.floor_polygon or graph.room.size,
        names=[node.name for node in graph.nodes],
    )


def sample_boxes(
    echo: Echo,
    graph: SceneGraph,
    *,
    seed: int,
    number: int,
    steps: int | None = None,
    change: GraphEdit | None = None,
    watch: Watch | None = None,
) -> Boxes:
    """Boxes from the layout branch in the room's frame; what the graph fixes is given to it and comes back."""
    batch = graph_batch(graph)
    centre = floor_centre(graph)
    nodes = graph.nodes
    given = torch.tensor([None not in (n.size, n.position, n.yaw) for n in nodes])
    known = Boxes(
        torch.tensor([n.size or (1.0, 1.0, 1.0) for n in nodes], dtype=torch.float32),
        torch.tensor([n.position or (0.0, 0.0, 0.0) for n in nodes], dtype=torch.float32) - centre,
        torch.tensor([n.yaw or 0.0 for n in nodes], dtype=torch.float32),
    )
    extra: dict[str, Any] = {"known": known, "known_mask": given} if bool(given.any()) else {}
    if steps is not None:
        extra["steps"] = steps
    if change is not None:
        extra["edit"] = change
    with (watch or Watch()).stage("layout") as tell, one_thread():
        found = echo.sample_layout(batch, generator=_generator(seed, "layout", number), progress=tell, **extra)
    return rounded_boxes(graph, Boxes(found.size, found.position + centre, found.yaw))


def sample_shapes(
    echo: Echo,
    graph: SceneGraph,
    boxes: Boxes,
    *,
    seed: int,
    steps: int | None = None,
    change: GraphEdit | None = None,
    watch: Watch | None = None,
) -> np.ndarray:
    """(n, 64, 64, 64) float32 TSDFs from the shape branch; raises ValueError for a model without one."""
    require_shapes(echo)
    centred = Boxes(boxes.size, boxes.position - floor_centre(graph), boxes.yaw)
    with (watch or Watch()).stage("shapes") as tell, one_thread():
        generator = _generator(seed, "shapes", 0)
        extra: dict[str, Any] = {} if change is None else {"edit": change}
        grids = echo.sample_shapes(
            graph_batch(graph), centred, generator=generator, steps=steps, progress=tell, **extra
        )
        return rounded_grids(np.asarray(grids))


def make_meshes(
    graph: SceneGraph,
    boxes: Boxes,
    grids: np.ndarray | None,
    *,
    faces: int = FACES,
    watch: Watch | None = None,
) -> tuple[dict[str, trimesh.Trimesh], dict[str, str]]:
    """Meshes in their boxes, and the name of the asset that each object uses.

    Arguments:
        graph, boxes: n objects.
        grids: (n, d, d, d) float TSDFs, or None for plain boxes.
        faces: face budget of each mesh.

    Raises ValueError naming the object whose shape holds no surface.
    """
    names = [node.name for node in graph.nodes]
    size = np.asarray(boxes.size, float)
    occupied = None if grids is None else grids < 0
    categories = [node.category for node in graph.nodes]
    owners = shared_assets(names, categories, style_groups(graph), size, occupied)
    meshes: dict[str, trimesh.Trimesh] = {}
    with (watch or Watch()).stage("meshes", len(names)) as tell:
        for i, name in enumerate(names):
            if owners[name] != name:
                meshes[name] = meshes[owners[name]]
            elif grids is None:
                meshes[name] = box_mesh(size[i])
            else:
                try:
                    meshes[name] = mesh_from_shape(grids[i], size[i], faces=faces).mesh
                except ValueError as error:
                    raise ValueError(f"shape of {name!r}: {error}; try another seed or shapes 'boxes'") from None
            tell(i + 1, len(names))
    return meshes, asset_names(owners, dict(zip(names, categories, strict=True)))


def judge(graph: SceneGraph, boxes: Boxes, *, rules: str = "strict") -> tuple[Verdict, ...]:
    """What became of every relation of the graph, in its order."""
    if not graph.relations:
        return ()
    triplets, centre = graph_batch(graph).triplets, floor_centre(graph)[[0, 2]]
    state = verdicts(boxes, triplets, rules=rules, center=centre).tolist()
    margin = margins(boxes, triplets, rules=rules, center=centre).tolist()
    return tuple(
        Verdict(r.subject, r.predicate, r.object, STATES[s], None if s < 0 else m)
        for r, s, m in zip(graph.relations, state, margin, strict=True)
    )


def floor_centre(graph: SceneGraph) -> torch.Tensor:
    """(3,) float32: the middle of the floor's bounding box, where the model's frame has its origin."""
    polygon = graph.room.floor_polygon
    if not polygon:
        return torch.zeros(3)
    corners = torch.tensor(polygon, dtype=torch.float32)
    middle = (corners.max(0).values + corners.min(0).values) / 2
    return torch.stack([middle[0], torch.zeros(()), middle[1]])


def room_floor(graph: SceneGraph, layouts: list[Boxes]) -> np.ndarray:
    """(k, 2) float: corners of the floor, from the graph or around the furniture of all layouts."""
    plan = [box_corners(*(np.asarray(v, float) for v in (b.size, b.position, b.yaw))) for b in layouts]
    return floor_polygon(graph.room.floor_polygon, graph.room.size, np.concatenate(plan))


def settled(graph: SceneGraph, boxes: Boxes, repair: bool, watch: Watch) -> tuple[Boxes, tuple[str, ...]]:
    """Sampled boxes after equal sizes within style groups and, if wanted, repair; and what could not be met."""
    boxes = _alike(graph, boxes)
    if not repair:
        return rounded_boxes(graph, boxes), ()
    from echousd.repair import repair as repaired

    with watch.stage("repair"):
        found = repaired(graph, boxes)
        same = _alike(graph, found.boxes, boxes)
        if not torch.equal(
            same.size, found.boxes.size
        ):  # chairs of one set that had to shrink: all of them, if it fits
            second = repaired(with_sizes(graph, same), same)
            if len(second.broken) <= len(found.broken) and len(second.collisions) <= len(found.collisions):
                found = second
    collisions = tuple(f"{a} and {b} collide by {depth:.2f} m" for a, b, depth in found.collisions)
    return rounded_boxes(graph, found.boxes), found.conflicts + collisions


def _alike(graph: SceneGraph, boxes: Boxes, judged_by: Boxes | None = None) -> Boxes:
    names, categories = [n.name for n in graph.nodes], [n.category for n in graph.nodes]
    free = np.array([node.size is None and not node.locked for node in graph.nodes])
    size = equal_sizes(
        names,
        categories,
        style_groups(graph),
        np.asarray(boxes.size, float),
        free,
        None if judged_by is None else np.asarray(judged_by.size, float),
    )
    return Boxes(torch.as_tensor(size, dtype=torch.float32), boxes.position, boxes.yaw)


def with_sizes(graph: SceneGraph, boxes: Boxes) -> SceneGraph:
    """The graph with the sizes of the boxes written into its nodes."""
    sizes = [tuple(row) for row in boxes.size.tolist()]
    return graph.replaced(nodes=tuple(n.replaced(size=s) for n, s in zip(graph.nodes, sizes, strict=True)))


def _generator(seed: int, branch: str, number: int) -> torch.Generator:
    """Independent randomness for each branch and layout, so that one more layout changes no other."""
    state = np.random.SeedSequence([seed, *branch.encode(), number]).generate_state(1, np.uint64)[0]
    return torch.Generator().manual_seed(int(state >> np.uint64(1)))
