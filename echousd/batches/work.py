"""What workers do: one room, from its graph to its folder; and which device they have."""

from __future__ import annotations

import hashlib
import os
import time
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echomodel.loading import require_device
from echousd.batches.options import BatchOptions
from echousd.batches.plan import room_digest
from echousd.batches.sources import sampled_graph
from echousd.graph import SceneGraph

if TYPE_CHECKING:
    from pxr import Usd

    from echousd.make.finished import Room


@dataclass(frozen=True)
class Job:
    """One room as a worker needs it.

    Arguments:
        id: its name; folder: where it goes; store: where its assets go, "" = into the folder.
        text: canonical JSON of its graph; draw: else the graph to draw (`plan.Entry.draw`).
        seed, options: as in the plan.
        outside: as of the run (`RunOptions`).
        begin: whether the room that its folder holds is edited to become that of the graph.
    """

    id: str
    folder: str
    seed: int
    options: BatchOptions
    text: str = ""
    draw: tuple[str, int, int] | None = None
    store: str = ""
    outside: tuple[str, ...] = ()
    begin: bool = False


def room(job: Job) -> dict[str, Any]:
    """Make, save and judge one room, and return its row of the manifest.

    Raises ValueError as `generate` and `Room.save` do.
    """
    from echousd.folder.folder import held
    from echousd.make.save import write_pictures
    from echousd.stage.files import open_stage

    started = time.perf_counter()
    folder = Path(job.folder)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = generated(job)
        with held(folder, wait=True):
            root = made.save(folder, preview=False, store=job.store)
            stage = open_stage(root)  # for its pictures and to judge it
            if job.options.preview:
                write_pictures(root, stage)
    facts = _facts(made, root, stage, settle=job.options.settle)
    facts["notes"] = [*made.notes, *(str(warning.message) for warning in caught)]
    facts["seconds"] = round(time.perf_counter() - started, 3)
    return facts


def generated(job: Job) -> Room:
    """The room of a job; raises ValueError as `generate` does."""
    if job.begin:
        from echousd.make.edit import edit

        return edit(job.folder, SceneGraph.from_json(job.text), outside=job.outside)
    from echousd.make.pipeline import generate

    if job.draw is not None and not job.text:
        graph = sampled_graph(*job.draw, job.options.relations)
    else:
        graph = SceneGraph.from_json(job.text)
    return generate(graph, options=job.options, seed=job.seed, outside=job.outside)


def _facts(made: Any, root: Path, stage: Usd.Stage, *, settle: bool) -> dict[str, Any]:
    from echousd.checks import check

    report = check(stage, settle=settle)
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


VISIBLE = "CUDA_VISIBLE_DEVICES"


def devices(device: str) -> list[dict[str, str]]:
    """The environment of every device of a kind, none for the CPU.

    Arguments:
        device: `cpu`, `cuda` (every one that is visible) or `mps`.

    Raises ValueError where torch finds no such device.
    """
    require_device(device)
    if device != "cuda":
        return [] if device == "cpu" else [{}]
    import torch

    count = torch.cuda.device_count()
    named = [word.strip() for word in os.environ.get(VISIBLE, "").split(",") if word.strip()]
    return [{VISIBLE: name} for name in (named or map(str, range(count)))][:count]
