"""What workers do: layouts of a pack of rooms in one pass of the network, and one room from its boxes to its folder."""

from __future__ import annotations

import hashlib
import os
import pickle
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from echousd.batches.options import BatchOptions
from echousd.batches.plan import room_digest
from echousd.batches.remote import deliver
from echousd.batches.sources import sampled_graph
from echousd.graph import SceneGraph

if TYPE_CHECKING:
    from echomodel.boxes import Boxes
    from echomodel.graph import GraphBatch
    from echomodel.protocols import RoomModel

Rows = list[list[float]]  # of one scene: seven numbers a box


@dataclass(frozen=True)
class Wanted:
    """Samples that a room wants from the process that has the device (`echousd.batches.work`)."""

    call: bytes


@dataclass(frozen=True)
class Job:
    """One room as a worker needs it.

    Arguments:
        id: its name; folder: where it goes; store: where its assets go, "" = into the folder.
        text: canonical JSON of its graph; draw: else the graph to draw (`plan.Entry.draw`).
        seed, options: as in the plan. first: draft of its first layout, None = sampled alone.
        answers: samples of the process that has the device.
        to: URL that `folder` and `store` are below, "" = they lie on a disk.
        outside: as of the run (`RunOptions`).
    """

    id: str
    folder: str
    seed: int
    options: BatchOptions
    text: str = ""
    draw: tuple[str, int, int] | None = None
    first: Rows | None = None
    store: str = ""
    answers: tuple[bytes, ...] = ()
    to: str = ""
    outside: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sampled:
    """What the network made of a job: text of its graph and its first draft, or an error."""

    text: str = ""
    first: Rows | None = None
    error: str = ""


def layouts(jobs: list[Job]) -> list[Sampled]:
    """The first drafts of a pack of rooms.

    A graph that the network refuses does not cost the others theirs: all are sampled alone then.
    """
    from echomodel.loading import load_model
    from echousd.make.layouts import first_drafts

    graphs: dict[int, SceneGraph] = {}
    out = [Sampled() for _ in jobs]
    for i, job in enumerate(jobs):
        try:
            graphs[i] = _checked(job)
        except ValueError as error:
            out[i] = Sampled(error=str(error))

    def sample(model: Any, rows: list[int], steps: int | None, guided: bool) -> None:
        chosen, seeds = [graphs[i] for i in rows], [jobs[i].seed for i in rows]
        for i, boxes in zip(rows, first_drafts(model, chosen, seeds, steps=steps, guided=guided), strict=True):
            out[i] = Sampled(graphs[i].to_json(), _rows(boxes))

    asked = {i: (one.weights, one.steps, not one.place) for i, one in ((i, jobs[i].options) for i in graphs)}
    for weights, steps, guided in dict.fromkeys(asked.values()):
        same = [i for i in graphs if asked[i] == (weights, steps, guided)]
        model = load_model(weights, device=jobs[same[0]].options.device)
        try:
            sample(model, same, steps, guided)
        except ValueError:
            for i in same:
                try:
                    sample(model, [i], steps, guided)
                except ValueError as error:
                    out[i] = Sampled(error=str(error))
    return out


def samples(asks: tuple[Job, Wanted]) -> bytes:
    """What the network of a job's options makes of what it wants."""
    from echomodel.loading import load_model
    from echousd.tensors import one_thread

    asked, wanted = asks[0].options, asks[1]
    with one_thread():
        return sampled(load_model(asked.weights, device=asked.device), wanted.call)


def room(job: Job) -> dict[str, Any] | Wanted:
    """Make, save and judge one room, and return its row of the manifest; or what it wants from the network first.

    Raises ValueError as `generate` and `Room.save` do.
    """
    if job.to:
        with tempfile.TemporaryDirectory(prefix="echousd-") as name:
            store = f"{name}/{job.store}" if job.store else ""
            made = room(replace(job, folder=f"{name}/{job.folder}", store=store, to=""))
            if isinstance(made, dict):
                made["stored"] = deliver(Path(name), job.folder, job.to)
            return made
    started = time.perf_counter()
    folder = Path(job.folder)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            made = generated(job)
        except SamplesWanted as wanted:
            return Wanted(wanted.call)
        root = made.save(folder, preview=job.options.preview, wait=True, store=job.store)
    facts = _facts(made, root, settle=job.options.settle)
    facts["notes"] = [*made.notes, *(str(warning.message) for warning in told)]
    facts["seconds"] = round(time.perf_counter() - started, 3)
    return facts


def generated(job: Job, *, here: bool = False) -> Any:
    """The room (`Room`) of a job.

    Arguments:
        here: this process has the device; else SamplesWanted is raised for what another one must sample.
    """
    from echomodel.loading import load_model
    from echousd.make.pipeline import generate

    first = None if job.first is None else _boxes(job.first)
    asked = job.options
    model = load_model(asked.weights, device=asked.device if here else CPU)
    if asked.device != CPU and not here:
        model = ElsewhereModel(model, job.answers)
    return generate(_checked(job), options=asked, seed=job.seed, model=model, first=first, outside=job.outside)


def _checked(job: Job) -> Any:
    """The graph, if a room can be made of it; raises ValueError."""
    from echousd.graph.floors import check_doors, check_space, without_openings
    from echousd.make.layouts import check_objects

    if job.draw is not None and not job.text:
        graph = sampled_graph(*job.draw, job.options.relations)
    else:
        graph = SceneGraph.from_json(job.text)
    if job.options.openings == "drawn":
        graph = without_openings(graph)
    check_objects(graph)
    check_doors(graph)
    if job.options.fit == "keep":
        check_space(graph)
    return graph


def _rows(boxes: Any) -> Rows:
    """float32 as the nearest Python floats, which give the same float32 again."""
    fields = (boxes.size.tolist(), boxes.position.tolist(), boxes.yaw.tolist())
    return [[*size, *position, yaw] for size, position, yaw in zip(*fields, strict=True)]


def _boxes(rows: Rows) -> Any:

    from echomodel.boxes import Boxes

    numbers = torch.tensor(rows, dtype=torch.float32)
    return Boxes(numbers[:, :3].contiguous(), numbers[:, 3:6].contiguous(), numbers[:, 6].contiguous())


def _facts(made: Any, root: Path, *, settle: bool) -> dict[str, Any]:
    from echousd.checks import check

    report = check(root, settle=settle)
    floor, geometry = made.floor, made.geometry
    states = Counter(verdict.state for verdict in made.verdicts)
    users = made.asset_users
    misplaced = [f"{one.object} is {one.problem}" for one in report.placement]
    errors = [f"{fault.rule} <{fault.prim}>: {fault.message}" for fault in report.errors]
    restless = [sentence for found in report.settled or () for sentence in found.sentences]
    low, high = floor.min(0), floor.max(0)
    text = made.graph.to_json()
    return {
        "graph": hashlib.sha256(text.encode()).hexdigest()[:16],
        "weights": made.provenance.model,
        "shapes": made.provenance.shapes,
        "type": made.graph.room.type,
        "root": root.name,
        "bounds": [round(float(v), 4) for v in (low[0], 0.0, low[1], high[0], made.height, high[1])],
        "objects": len(made.names),
        "categories": dict(sorted(Counter(node.category for node in made.graph.nodes).items())),
        "relations_asked": states["kept"] + states["broken"],
        "relations_kept": states["kept"],
        "living_faults": [fault.says for fault in report.layouts[0].living],
        "collisions": len(report.collisions),
        "restless": len(restless),
        "check": report.ok,
        "check_errors": [text[:300] for text in (*restless, *misplaced, *errors)][:10],
        "faces": sum(geometry[name].faces for name in users.values()),
        "licences": sorted({geometry[name].origin.licence for name in users.values()} - {""}),
        "bytes": sum(path.stat().st_size for path in root.parent.rglob("*") if path.is_file()),
        "sha256": room_digest(root.parent),
    }


METHODS = ("sample_layout", "sample_shapes", "sample_furniture")


class SamplesWanted(Exception):  # no error: the caller has them sampled and asks again
    """A room wants samples that its process does not draw; `call` is what `sampled` takes."""

    def __init__(self, call: bytes) -> None:
        super().__init__()
        self.call = call


class ElsewhereModel:
    """`RoomModel` with the samples of another process; all else is its own model's.

    Arguments:
        own: a model with the same weights in this process. answers: what `sampled` gave, call by call.
    """

    def __init__(self, own: RoomModel, answers: tuple[bytes, ...]) -> None:
        self.own = own
        self._answers: Iterator[bytes] = iter(answers)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.own, name)

    def sample_layout(self, graph: GraphBatch, **rest: Any) -> Boxes:
        """As of the model; raises SamplesWanted."""
        found: Boxes = self._sampled("sample_layout", (graph,), rest)
        return found

    def sample_shapes(self, graph: GraphBatch, boxes: Boxes, **rest: Any) -> torch.Tensor:
        """As of the model; raises SamplesWanted."""
        found: torch.Tensor = self._sampled("sample_shapes", (graph, boxes), rest)
        return found

    def sample_furniture(self, graph: GraphBatch, boxes: Boxes, **rest: Any) -> torch.Tensor:
        """As of the model; raises SamplesWanted."""
        found: torch.Tensor = self._sampled("sample_furniture", (graph, boxes), rest)
        return found

    def _sampled(self, method: str, given: tuple[Any, ...], rest: dict[str, Any]) -> Any:
        answer = next(self._answers, None)
        if answer is None:
            state = rest.pop("generator").get_state()
            rest.pop("progress", None)
            raise SamplesWanted(pickle.dumps((method, given, state, rest)))
        return pickle.loads(answer)


def sampled(model: RoomModel, call: bytes) -> bytes:
    """What a model samples for a call of `SamplesWanted`, for `ElsewhereModel`; raises what the model raises."""
    method, given, state, rest = pickle.loads(call)
    if method not in METHODS:
        raise ValueError(f"{method!r:.40} is no call for samples, allowed: {', '.join(METHODS)}")
    generator = torch.Generator()
    generator.set_state(state)
    return pickle.dumps(getattr(model, method)(*given, generator=generator, **rest).to("cpu"))


CPU = "cpu"
VISIBLE = "CUDA_VISIBLE_DEVICES"


def network_processes(device: str) -> list[dict[str, str]]:
    """The environment of every process that runs the network alone: one a device; none where the workers run it.

    Arguments:
        device: `cpu`, `cuda` (every one that is visible) or `mps`.

    Raises ValueError where torch finds no such device.
    """
    if device == CPU:
        return []

    if device == "cuda" and torch.cuda.is_available():
        count = torch.cuda.device_count()
        named = [word.strip() for word in os.environ.get(VISIBLE, "").split(",") if word.strip()]
        return [{VISIBLE: name} for name in (named or map(str, range(count)))][:count]
    if device == "mps" and torch.backends.mps.is_available():
        return [{}]
    found = [CPU, *["cuda"] * torch.cuda.is_available(), *["mps"] * torch.backends.mps.is_available()]
    raise ValueError(f"device is {device!r}, which torch {torch.__version__} finds none of; here: {', '.join(found)}")
