"""Which objects of a room are models of other people, which ones, and what sizes they insist on."""

from collections.abc import Callable, Container, Mapping

import numpy as np

from echomodel.files import raising
from echomodel.progress import StageTimer
from echomodel.vocabulary import vocabulary
from echousd.assets.choose import Asked, AssetWishes, choose, fits
from echousd.assets.model_file import ModelFile
from echousd.assets.record import AssetRecord
from echousd.assets.reference import MODELS, is_file
from echousd.graph import Node, SceneGraph
from echousd.shapes.finishes.slots import HARMONIES, linear
from echousd.shapes.originals.loading import library_file, own_file, own_record
from echousd.shapes.sources.named import RETRIEVED, source_of
from echousd.shapes.sources.source import Retrieved, ShapeRequest
from echousd.shapes.sources.whole import shape_nearness
from echousd.shapes.styles import ALIKE, ROOM_STYLE, first_alike

Wanted = Callable[[], AssetWishes]  # what is asked of a library, made where it is needed

TOGETHER = ("at", "head", "beside")  # slot_roles of things that come in pairs and sets


def named_pieces(
    graph: SceneGraph, wishes: Wanted, among: Container[str] | None = None, timer: StageTimer | None = None
) -> Retrieved:
    """The models that the graph names itself, with their real sizes; raises ValueError that names object and file.

    `among`: names of the objects that are looked at, None = all.
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
            with raising(f"object {node.name!r}:", ValueError, ImportError):
                chosen[node.name], files[node.name] = _named(node, asked)
    sizes = {node.name: chosen[node.name].dims for node in named if node.size is None}
    return Retrieved(chosen, files, sizes, collect=asked.collect)


def _named(node: Node, wishes: AssetWishes) -> tuple[AssetRecord, ModelFile]:
    assert node.asset is not None
    if is_file(node.asset):
        return own_record(node.asset, node.category), own_file(node.asset)
    if wishes.library is None:
        models = f"a file that ends in {', '.join(MODELS)}"
        raise ValueError(f"asset {node.asset!r} is of a library, but none is given (--assets LIB), allowed: {models}")
    record = wishes.library.records.get(node.asset)
    if record is None or record.fault:
        why = "is not in it" if record is None else record.fault
        raise ValueError(f"{wishes.library.file}: asset {node.asset!r} {why}")
    return record, library_file(wishes.library, record)


def retrieved(request: ShapeRequest, shapes: str, wishes: Wanted, palette: str) -> Retrieved:
    """The models of all objects that come from a library besides those that the graph names, which are known.

    The layout must give each the size that it has in the request, or its own where it cannot be stretched to that.

    `shapes`: the room's source. `palette`: harmony of the room, whose colours models shall go with.
    """
    graph, named = request.graph, request.retrieved
    sources = {i: source_of(graph.nodes[i], shapes) for i in request.rows}
    wanted = [i for i, source in sources.items() if source in RETRIEVED]
    if not wanted:
        return named
    asked = wishes()
    near = shape_nearness(request, shapes, asked) if "guided" in sources.values() else None
    with request.timer.stage("assets"):
        tones = np.array([linear(color) for color in HARMONIES[palette].values()])
        size = np.asarray(request.boxes.size, float)
        pieces = _asked(graph, wanted, size, request.styles)
        chosen, missing = choose(asked, pieces, request.seed, kept=named.chosen, nearness=near, palette=tones)
        files, sizes = dict(named.files), dict(named.sizes)
        for i in wanted:
            node = graph.nodes[i]
            record = chosen.get(node.name)
            if record is None or node.name in named.chosen:
                continue
            assert asked.library is not None
            files[node.name] = library_file(asked.library, record)
            sizes[node.name] = tuple(size[i].tolist()) if fits(record, size[i], asked.stretch) else record.dims
    return Retrieved(chosen, files, sizes, tuple(missing), asked.collect)


def _asked(graph: SceneGraph, rows: list[int], size: np.ndarray, styles: Mapping[str, str]) -> list[Asked]:
    """The objects with who shares a model with whom: those of one category and style group, and sets."""
    nodes = graph.nodes

    def same(i: int, j: int) -> bool:
        near = 2 * ALIKE if styles[nodes[i].name] == ROOM_STYLE else np.inf
        agree = nodes[i].category == nodes[j].category and styles[nodes[i].name] == styles[nodes[j].name]
        return agree and bool(np.abs(np.log(size[i] / size[j])).max() <= near)

    shared = [i for i in rows if styles[nodes[i].name] != ROOM_STYLE
              or vocabulary().category(nodes[i].category).stands in TOGETHER]  # fmt: skip
    first = first_alike(shared, same)
    out = []
    for i in rows:
        node, style = nodes[i], styles[nodes[i].name]
        box = (float(size[i][0]), float(size[i][1]), float(size[i][2]))
        shares = nodes[first[i]].name if i in first else ""
        out.append(Asked(node.name, node.category, style, box, shares, f"{style} {node.name}".replace("_", " ")))
    return out
