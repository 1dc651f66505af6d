"""Which objects of a room are models of other people, which ones, and what sizes they insist on."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.assets.reference import Vector, check_reach, is_file, joined, relative, split
from echousd.graph import Node, SceneGraph
from echousd.progress import StageTimer
from echousd.shapes.finishes.slots import HARMONIES, linear
from echousd.shapes.looks import palette_of_room
from echousd.shapes.styles import ALIKE, ROOM_STYLE

if TYPE_CHECKING:
    from echomodel.boxes import Boxes
    from echousd.assets.choose import Asked, AssetWishes
    from echousd.assets.model_file import ModelFile
    from echousd.assets.record import AssetRecord

    Wanted = Callable[[], AssetWishes]  # what is asked of a library, made where it is needed

RETRIEVED = ("library", "guided")
TOGETHER = ("at", "head", "beside")  # stances of things that come in pairs and sets


@dataclass(frozen=True, eq=False)
class Retrieved:
    """What is known of the models of a room."""

    chosen: Mapping[str, AssetRecord] = field(default_factory=dict)  # object name -> model
    files: Mapping[str, ModelFile] = field(default_factory=dict)  # object name -> where it lies
    # object name -> (3) metres that the layout must give it, as the model cannot be stretched to another
    sizes: Mapping[str, Vector] = field(default_factory=dict)
    missing: tuple[str, ...] = ()  # objects that the library has nothing for
    collect: bool = False  # take models along with all that they need

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence for what could not be had."""
        if not self.missing:
            return ()
        return (f"the library has nothing for {', '.join(self.missing)}: made by the project's own programs",)


def source_of(node: Node, shapes: str) -> str:
    """The source of one object: its own word, what its asset asks for, else the room's."""
    if node.shapes:
        return node.shapes
    return shapes if node.asset is None else "own" if is_file(node.asset) else "library"


def anchored(graph: SceneGraph, folder: Path) -> SceneGraph:
    """The graph with the files of assets as absolute paths; relative ones are in `folder`."""
    return _moved(graph, lambda file: (folder.absolute() / file).as_posix())


def check_files(
    graph: SceneGraph, folder: Path, outside: Sequence[str | Path], file: str, among: Container[str] | None = None
) -> None:
    """Raises ValueError for an asset of a graph that was read whose file lies elsewhere than the graph's own.

    `graph`: as `anchored` gives it. `folder`: of the graph's file. `outside`: folders that are allowed besides. `file`:
    what the error calls the graph. `among`: names of the objects that are looked at, None = all.
    """
    for node in graph.nodes:
        if node.asset is not None and is_file(node.asset) and (among is None or node.name in among):
            path, allowed = Path(split(node.asset)[0]), [*map(Path, outside)]
            check_reach(path, folder, allowed, f"{file}: object {node.name!r}: asset")


def beside(graph: SceneGraph, folder: Path) -> SceneGraph:
    """The graph with the files of assets relative to a room's folder, as a saved room tells them."""
    return _moved(graph, lambda file: relative(Path(file), folder.absolute() / "graph"))


def _moved(graph: SceneGraph, change: Callable[[str], str]) -> SceneGraph:
    """The graph with the files of its assets under other names, itself where there are none."""

    def node_of(node: Node) -> Node:
        if node.asset is None or not is_file(node.asset):
            return node
        file, prim = split(node.asset)
        return node.replaced(asset=joined(change(file), prim))

    nodes = tuple(map(node_of, graph.nodes))
    return graph if nodes == graph.nodes else graph.replaced(nodes=nodes)


def given_pieces(
    graph: SceneGraph, shapes: str, wishes: Wanted, among: Container[str] | None = None, timer: StageTimer | None = None
) -> Retrieved:
    """The models that the graph names itself, with their real sizes; raises ValueError that names object and file.

    `shapes`: the room's source. `among`: names of the objects that are looked at, None = all.
    """
    nodes = [node for node in graph.nodes if among is None or node.name in among]
    named = [node for node in nodes if node.asset is not None]
    if not named:
        return Retrieved()
    chosen: dict[str, AssetRecord] = {}
    files: dict[str, ModelFile] = {}
    asked = wishes()
    with (timer or StageTimer()).stage("assets"):
        for node in named:
            try:
                chosen[node.name], files[node.name] = _given(node, asked)
            except (ValueError, ImportError) as error:
                raise ValueError(f"object {node.name!r}: {error}") from None
    sizes = {node.name: chosen[node.name].dims for node in named if node.size is None}
    return Retrieved(chosen, files, sizes, collect=asked.collect)


def _given(node: Node, wishes: AssetWishes) -> tuple[AssetRecord, ModelFile]:
    from echousd.shapes.originals.loading import library_file, own_file, own_record

    assert node.asset is not None
    if is_file(node.asset):
        return own_record(node.asset, node.category), own_file(node.asset)
    if wishes.library is None:
        raise ValueError(f"asset {node.asset!r} is in a library, but none is given; name one (--assets LIB)")
    record = wishes.library.records.get(node.asset)
    if record is None or record.fault:
        why = "is not in it" if record is None else record.fault
        raise ValueError(f"{wishes.library.file}: asset {node.asset!r} {why}")
    return record, library_file(wishes.library, record)


def retrieved(
    graph: SceneGraph, boxes: Boxes, styles: Mapping[str, str], shapes: str, wishes: Wanted, seed: int,
    given: Retrieved, nearness: Mapping[str, Mapping[str, float]] | None = None, among: Container[str] | None = None,
    palette: str = "", timer: StageTimer | None = None,
) -> Retrieved:  # fmt: skip
    """The models of all objects that come from a library, and the sizes of those that their boxes do not fit.

    `boxes`: n boxes in the order of the nodes. `styles`: object name -> style. `shapes`: the room's source. `given`:
    what `given_pieces` found. `nearness`: as for `choose`. `among`, `timer`: as for `given_pieces`. `palette`: harmony
    of the room, whose colours models shall go with; "" = that which the seed chooses.
    """
    wanted = [
        i
        for i, node in enumerate(graph.nodes)
        if source_of(node, shapes) in RETRIEVED and (among is None or node.name in among)
    ]
    if not wanted:
        return given
    from echousd.assets.choose import choose, fits
    from echousd.shapes.originals.loading import library_file

    asked = wishes()
    size = np.asarray(boxes.size, float)
    with (timer or StageTimer()).stage("assets"):
        tones = np.array([linear(color) for color in HARMONIES[palette or palette_of_room(seed, graph.room.style)]])
        chosen, missing = choose(
            asked, _asked(graph, wanted, size, styles), seed, kept=given.chosen, nearness=nearness, palette=tones
        )
        files, sizes = dict(given.files), dict(given.sizes)
        for i in wanted:
            node = graph.nodes[i]
            record = chosen.get(node.name)
            if record is None or node.name in given.chosen:
                continue
            assert asked.library is not None
            files[node.name] = library_file(asked.library, record)
            if not fits(record, size[i], asked.stretch) and node.size is None:
                sizes[node.name] = record.dims
    return Retrieved(chosen, files, sizes, tuple(missing), asked.collect)


def _asked(graph: SceneGraph, rows: list[int], size: np.ndarray, styles: Mapping[str, str]) -> list[Asked]:
    """The objects with who shares a model with whom: those of one category and style group, and sets."""
    from echousd.assets.choose import Asked

    heads: list[tuple[int, str]] = []
    out = []
    for i in rows:
        node = graph.nodes[i]
        style = styles[node.name]
        shares = ""
        if style != ROOM_STYLE or vocabulary().category(node.category).stands in TOGETHER:
            near = 2 * ALIKE if style == ROOM_STYLE else np.inf
            shares = next(
                (
                    name
                    for first, name in heads
                    if (graph.nodes[first].category, styles[graph.nodes[first].name]) == (node.category, style)
                    and np.abs(np.log(size[i] / size[first])).max() <= near
                ),
                node.name,
            )
            if shares == node.name:
                heads.append((i, node.name))
        box = (float(size[i][0]), float(size[i][1]), float(size[i][2]))
        out.append(Asked(node.name, node.category, style, box, shares, f"{style} {node.name}".replace("_", " ")))
    return out


def with_given_sizes(graph: SceneGraph, sizes: Mapping[str, Vector]) -> SceneGraph:
    """The graph in which the sizes of some objects are fixed."""
    if not sizes:
        return graph
    nodes = (replace_size(node, sizes) for node in graph.nodes)
    return graph.replaced(nodes=tuple(nodes))


def replace_size(node: Node, sizes: Mapping[str, Vector]) -> Node:
    """The node with the size that is known for it, unless it states its own."""
    if node.size is not None or node.name not in sizes:
        return node
    return node.replaced(size=sizes[node.name])
