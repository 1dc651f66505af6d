"""Which models of other people a graph names: the source of each object, and the files, from where and allowed."""

from collections.abc import Callable, Container, Sequence
from pathlib import Path

from echomodel.late import lates
from echousd.graph import Node, SceneGraph

check_reach, is_file, joined, relative, split = lates(
    "echousd.assets.reference", "check_reach", "is_file", "joined", "relative", "split"
)
RETRIEVED = ("library", "guided")


def source_of(node: Node, shapes: str) -> str:
    """The source of one object: its own word, what its asset asks for, else the room's."""
    if node.shapes:
        return node.shapes
    return shapes if node.asset is None else "own" if is_file(node.asset) else "library"


def names_models(graph: SceneGraph, shapes: str, among: Container[str]) -> bool:
    """Whether any object of some names is somebody's model, or is to be of a library; `shapes`: the room's source."""
    named = (node for node in graph.nodes if node.name in among)
    return any(node.asset is not None or source_of(node, shapes) in RETRIEVED for node in named)


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
