"""A home on disk: every room furnished in its place by workers side by side, and the layers that compose them."""

import hashlib
import json
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf

import echousd
from echomodel.files import check_ours
from echomodel.openings import KINDS, numbered
from echomodel.triangles import box
from echousd.batches.batch import MEMORY, cores, weights_hash
from echousd.batches.executor import LocalWorkers, Task
from echousd.batches.options import BatchOptions
from echousd.batches.work import Job, room
from echousd.folder.found import is_home
from echousd.folder.lock import LOCK, locked
from echousd.folder.manifest import find_manifest
from echousd.graph import SceneGraph
from echousd.home.existing import next_plan, plan_there
from echousd.home.graph import HomeGraph, home_of_plain
from echousd.home.plan import HomePlan, doorways
from echousd.home.stages import HOME, home_layer, room_path
from echousd.layers.assets import write_mesh
from echousd.naming import HOME as ROOT_FILE
from echousd.naming import HOUSE as MARK
from echousd.options import MAX_SEED, RoomOptions
from echousd.shapes.geometry import CREASE
from echousd.shapes.looks import palette_of_room
from echousd.shapes.surface import surfaces
from echousd.shapes.walls import THICKNESS
from echousd.stage.files import layer_bytes, layer_there, open_stage, write_all
from echousd.stage.pen import Pen
from echousd.stage.shading import preview_surface
from echousd.stage.turning import rescale, turn_up

PLAN = "plan.usda"
FOLDER, PLANS = "rooms", "plans"  # below a home: its rooms, and by number all plans that it had
ONCE = ("DomeLight", "DistantLight", "PhysicsScene")  # a home has one of each, its first room's
THRESHOLD = (0.45, 0.36, 0.27)  # colour, linear


@dataclass(frozen=True)
class Made:
    """A home that was written.

    Arguments:
        root: its layer. rooms: what became of each (rows as of a batch's manifest), of those that stayed nothing.
        failed: why, of rooms that could not be made.
    """

    root: Path
    rooms: Mapping[str, Mapping[str, Any] | None]
    failed: Mapping[str, str]


def generate_home(
    home: HomeGraph | HomePlan, output: str | Path, *, force: bool = False, workers: int | None = None, **options: Any
) -> Made:
    """Plan a home, furnish its rooms side by side and write them to a folder, from whose plan a new one begins.

    Arguments:
        home: its graph, or a plan that it has. workers: processes, None = one for each core.
        options: of its rooms, as for `echousd.generate`.

    Raises `GraphError` where no plan keeps the graph, ValueError for a folder that holds something else.
    """
    asked, folder = RoomOptions(**options), Path(output)
    if isinstance(home, HomeGraph):
        home = next_plan(home, seed=asked.seed, before=earlier(folder, asked.seed))
    return write_rooms(home, folder, asked, force=force, workers=workers)


def jobs_of(plan: HomePlan, output: Path, options: RoomOptions, outside: Sequence[str] = ()) -> dict[str, Job]:
    """What workers need to make each room: its graph in the plan, a seed of its own, one palette for all."""
    fields = options.model_dump(exclude={"like", "room_path"}) | {
        "palette": options.palette or palette_of_room(options.seed),
        "fit": "drop",  # no piece too many keeps a home from being made
    }
    jobs = {}
    for each in plan.home.rooms:
        seed = (options.seed + zlib.crc32(each.name.encode())) % MAX_SEED
        asked = BatchOptions(**{**fields, "seed": seed, "openings": "doors" if each.name in plan.lit else "kept"})
        folder = str(output / FOLDER / each.name)
        jobs[each.name] = Job(each.name, folder, seed, asked, plan.graph(each.name).to_json(), outside=tuple(outside))
    return jobs


def digests_of(jobs: Mapping[str, Job]) -> dict[str, str]:
    """Of all that decides each room's bytes."""
    found, weights = {}, cache(weights_hash)
    for name, job in jobs.items():
        inputs = [job.text, job.seed, job.options.model_dump(), weights(job.options.weights), echousd.__version__]
        found[name] = hashlib.sha256(json.dumps(inputs, default=str, sort_keys=True).encode()).hexdigest()[:16]
    return found


def write_rooms(
    plan: HomePlan, output: Path, options: RoomOptions, *, outside: Sequence[str] = (), force: bool = False,
    workers: int | None = None, tell: Callable[[int, int], None] = lambda done, total: None, wait: bool = False,
    number: int | None = None,
) -> Made:  # fmt: skip
    """Make a home in a folder: rooms whose graph, place in the plan and options are as before keep their bytes.

    Arguments:
        tell: called with how many rooms are done, and of how many. wait: for another process that writes the folder.
        number: of a plan that the home had (`stepped`), None = it is new, and what was undone is given up.

    Raises ValueError for a folder that holds something else or that another process writes, and where edits of a room
    would be lost.
    """
    root = output / ROOT_FILE
    if not is_home(root):
        check_ours(output, "home of echousd", force=force, besides=(FOLDER, PLANS, LOCK))
    with locked(output, wait=wait):  # rooms and the layers over them are of one run
        wanted, digests = wanted_jobs(plan, output, options, outside)
        edited = [job.id for job in wanted if not job.begin and _edited(Path(job.folder))]
        if edited and not force:
            raise ValueError(
                f"{output}: {', '.join(edited)} would be made anew, which gives up what was edited in it since; "
                "allowed: --force, or the same edit in the home's graph"
            )
        done: dict[str, Mapping[str, Any] | None] = dict.fromkeys(digests)
        failed: dict[str, str] = {}
        for name, value, error in _run(wanted, workers):
            done[name] = value
            failed |= {name: error} if error else {}
            tell(sum(value is not None for value in done.values()) + len(failed), len(wanted))
        plan = furnished_plan(plan, output)
        digests = digests_of(jobs_of(plan, output, options, outside))
        marks = {name: digest for name, digest in digests.items() if name not in failed}
        if marks:
            write_all(files := home_files(plan, output, marks, options, number))
            *_, now = files
            for undone in now.parent.glob("*.usda") if number is None else ():
                if undone.stem.isdecimal() and int(undone.stem) > int(now.stem):
                    undone.unlink()
        return Made(root, done, failed)


def furnished_plan(plan: HomePlan, output: Path) -> HomePlan:
    """The plan with the windows that rooms were given where their furniture leaves the walls free."""
    found = {name: find_manifest(output / FOLDER / name) for name in plan.lit}
    there = {name: SceneGraph.from_json(json.dumps(own["graph"])).room.openings for name, own in found.items() if own}
    return replace(plan, openings={**plan.openings, **there}, lit=plan.lit - there.keys())


def _edited(folder: Path) -> bool:
    """Whether a room was edited but for its openings, which are the plan's."""
    steps = [step for edit in (find_manifest(folder) or {}).get("history", ()) for step in edit["steps"]]
    return not all(step.lstrip("+-~ ").startswith(KINDS) for step in steps)


def wanted_jobs(
    plan: HomePlan, output: Path, options: RoomOptions, outside: Sequence[str] = ()
) -> tuple[list[Job], dict[str, str]]:
    """The jobs of the rooms that a folder does not hold as they would be made, and the digest of every room.

    Where nothing but a room's openings is to be another, its job is to edit what is there.
    """
    jobs = jobs_of(plan, output, options, outside)
    root, layer = earlier(output, options.seed), layer_there(output / ROOT_FILE)
    digests, marks = digests_of(jobs), dict(layer.customLayerData.get("rooms", {})) if layer else {}
    there = {name: find_manifest(output / FOLDER / name) for name in jobs}
    again = [name for name in jobs if not there[name] or marks.get(name) != digests[name]]
    before, asked = remembered(root) if again and root else (None, None)
    kept = before.rooms if before and asked == options else ()
    same = {name: manifest for name in again if (manifest := there[name]) and plan.home.room(name) in kept}
    return [_opened(jobs[name], same[name], plan) if name in same else jobs[name] for name in again], digests


def _opened(job: Job, manifest: Mapping[str, Any], plan: HomePlan) -> Job:
    spec, there = plan.graph(job.id).room, SceneGraph.from_json(json.dumps(manifest["graph"]))
    if not there.room.replaced(openings=spec.openings) == spec != there.room:
        return job
    ours = manifest.get("generator") == f"echousd {echousd.__version__}"
    return replace(job, text=there.replaced(room=spec).to_json(), begin=True) if ours else job


def remembered(root: Path) -> tuple[HomeGraph, RoomOptions]:
    """What was asked of a home that was made: its graph and the options of its rooms."""
    layer = layer_there(root)
    data = dict(layer.customLayerData) if layer else {}
    if "asked" not in data:
        raise ValueError(f"{root}: says nothing of what was asked of it, allowed: a home that echousd generate made")
    return home_of_plain(json.loads(data["asked"])), RoomOptions(**json.loads(data["options"]))


def stepped(root: Path, by: int) -> tuple[HomePlan, int]:
    """The plan that a home had before its last edit (`by` -1), or before that was taken back (1), and its number.

    Raises ValueError where there is none.
    """
    number = _number(root) + by
    file = root.parent / PLANS / f"{number}.usda"
    plan = plan_there(file) if file.is_file() else None
    if plan is None:
        raise ValueError(f"{root}: no edit of the home to {'undo' if by < 0 else 'redo'}")
    return plan, number


def _number(root: Path) -> int:
    """Which of its plans a home has."""
    layer = layer_there(root)
    number = layer.customLayerData.get("plan", 0) if layer else 0
    return number if isinstance(number, int) else 0


def _run(jobs: Sequence[Job], workers: int | None) -> Iterator[tuple[str, Mapping[str, Any] | None, str]]:
    """Name, row and error of every job, as they end; nothing is started for none."""
    waiting = sorted(jobs, key=lambda job: -len(job.text))  # the fullest first
    if not waiting:
        return
    pool = LocalWorkers(min(workers or cores(), len(waiting)), memory=MEMORY)
    try:
        running = 0
        while waiting or running:
            while waiting and pool.free():
                job = waiting.pop(0)
                pool.submit(Task(job.id, room, job))
                running += 1
            for outcome in pool.outcomes(60.0):
                running -= 1
                yield outcome.task.key, outcome.value if outcome.fate == "done" else None, outcome.error
    finally:
        pool.close()


def earlier(output: Path, seed: int) -> Path | None:
    """The home that is in a folder, None where there is none of this seed."""
    root = output / ROOT_FILE
    layer = layer_there(root)
    return root if layer and layer.customLayerData.get("seed") == seed else None


def home_files(
    plan: HomePlan, output: Path, digests: Mapping[str, str], options: RoomOptions, number: int | None = None
) -> dict[Path, bytes]:
    """The root layer, which has the rooms as payloads, below it the layer of the graph and the plan, and the same with
    the rooms' graphs, as it is kept for `stepped`.

    Arguments:
        digests: of the rooms that there are. number: of a plan that the home had, None = a new one.
    """
    below, whole = home_layer(plan.home, plan, rooms=False), layer_bytes(home_layer(plan.home, plan), ".usda")
    if number is None:
        number = _number(output / ROOT_FILE)
        kept = output / PLANS / f"{number}.usda"
        number += kept.is_file() and kept.read_bytes() != whole
    _thresholds(below, plan)
    root = Sdf.Layer.CreateAnonymous(".usda")
    root.subLayerPaths.append(f"./{PLAN}")
    root.defaultPrim = HOME[1:]
    about = {MARK: 1, "generator": f"echousd {echousd.__version__}", "seed": options.seed}
    asked = {"asked": plan.home.to_json(), "options": json.dumps(options.model_dump(exclude_defaults=True))}
    root.customLayerData = {**about, **asked, "plan": number, "rooms": dict(digests)}
    for key in ("metersPerUnit", "upAxis"):
        root.pseudoRoot.SetInfo(key, below.pseudoRoot.GetInfo(key))
    for place, name in enumerate(digests):
        spec = Sdf.CreatePrimInLayer(root, room_path(name))
        file = Path(FOLDER) / name / f"{(find_manifest(output / FOLDER / name) or {})['name']}.usda"
        spec.payloadList.prependedItems.append(Sdf.Payload(f"./{file.as_posix()}"))
        if place:
            stage = open_stage(output / file)
            for prim in stage.Traverse():
                if prim.GetTypeName() in ONCE and prim.GetPath().HasPrefix(stage.GetDefaultPrim().GetPath()):
                    inside = prim.GetPath().ReplacePrefix(stage.GetDefaultPrim().GetPath(), room_path(name))
                    Sdf.CreatePrimInLayer(root, inside).active = False
    for layer in (root, below):
        rescale(layer, options.meters_per_unit)
        if options.up_axis == "Z":
            turn_up(layer)
    files = {output / ROOT_FILE: layer_bytes(root, ".usda"), output / PLAN: layer_bytes(below, ".usda")}
    return {**files, output / PLANS / f"{number}.usda": whole}


def _thresholds(layer: Sdf.Layer, plan: HomePlan) -> None:
    """Author floors in the doorways, where those of the rooms end: /House/Plan, one for each way through."""
    pen, above = Pen(layer), f"{HOME}/Plan"
    pen.define(above, "Xform", kind="group")
    pen.define(f"{above}/Looks", "Scope")
    preview_surface(pen, f"{above}/Looks/threshold", {"diffuseColor": THRESHOLD})
    taken: list[str] = []
    for (one, other), _, ((low_x, low_z), (high_x, high_z)) in doorways(plan):
        name = numbered(f"threshold_{one}_{other}", taken)
        taken.append(name)
        pen.define(f"{above}/{name}", "Xform", kind="component")
        pen.label(f"{above}/{name}", category="floor")
        slab = box((low_x, -THICKNESS, low_z), (high_x, 0.0, high_z))
        mesh = f"{above}/{name}/{name}_mesh"
        write_mesh(pen, mesh, surfaces([(slab, {"threshold": np.arange(len(slab.faces))}, CREASE)])[0])
        pen.over(mesh, apis=["PhysicsCollisionAPI"])
        pen.bind(mesh, f"{above}/Looks/threshold")
