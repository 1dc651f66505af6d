"""The sections of a suite: each makes its tables of one run."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.loading import load_model
from echomodel.metrics.layouts import layout_scores, strata_of
from echomodel.metrics.pictures import WEIGHTS, body_scores, features, picture, picture_figures, told_by_pictures
from echomodel.metrics.sets import AXES, layout_distance, set_figures, size_distances, size_scores, told_apart
from echomodel.metrics.statistics import Counts, Figure, figure
from echomodel.metrics.tasks import GROUPS, Task, changed, extended, kept_relations, tasks_of
from echomodel.roomboxes import RoomBoxes
from echousd.evaluation.pieces import shapes
from echousd.evaluation.runs import Run, Table, figures, note, run_systems
from echousd.evaluation.systems import System, networks

AGAIN, ALIKE = 1, 8  # added to the seed for a second layout of the same graph; rooms that are laid out twice
OTHERS = "other rooms"  # of the source
NAMES = {"inception": ("FID", "KID x 1000"), "clip": ("FID-CLIP",)}
ROOMS: dict[str, tuple[str, ...]] = {  # of the paper: a living and dining room counts as both; all of them
    "": (), "bedroom": ("bedroom",), "living_room": ("living_room", "living_dining_room"),
    "dining_room": ("dining_room", "living_dining_room"),
}  # fmt: skip
LEAST, SHOWN = 4, 6  # rooms of a type that have a figure of their own; that are shown
SWEPT = (2, 5, 10, 20, 50)  # steps of sampling
SETTLED = 4  # rooms that are simulated


def relations(run: Run) -> list[Table]:
    """The paper's Table 2: half of all relations told by the published rules; plain, after a change, an addition."""
    settings, rooms = run.settings, [task.room for task in run.tasks]
    plain = tasks_of(rooms, settings.seed, rules="sgfront")
    rng = np.random.default_rng([settings.seed, 12])
    modes = {
        "as told": plain,
        "after a change": [changed(task, rng) for task in plain[::2]],
        "after an addition": [extended(task, rng) for task in plain[::2]],
    }
    tables = []
    for mode, tasks in modes.items():
        made, _ = run_systems(run.asked, tasks, settings)
        scores = {name: list(map(kept_relations, tasks, found)) for name, found in made.items()}
        columns = [*GROUPS, "all"] + (["edited", "rest"] if tasks is not plain else [])
        rows = figures(scores, columns, settings.seed, run.asked[0].name)
        tables.append(Table("relations", f"Relations kept, {mode}", note("relations"), rows))
    return tables


def faults(run: Run) -> list[Table]:
    """What a person would point at, by kind, stratum and term."""
    scores = _scored(run.made, run.of)
    first, seed = next(iter(scores)), run.settings.seed
    columns = ["told", "faults", "faults A", "faults B", "faultless", "physics"]
    rows = figures(scores, columns, seed, first)
    tables = [Table("faults", "Faults an object", note("faults", told=run.settings.relations), rows)]
    for stratum in strata_of(run.tasks[0]):
        rows = {}
        for name, found in scores.items():
            words = np.array([strata_of(task)[stratum] for task in run.of[name]])
            counts = Counts.of([one["faults"] for one in found])
            rows[name] = {
                f"{word} ({number})": figure(counts.at(words == word), seed)
                for word, number in zip(*np.unique(words, return_counts=True), strict=True)
            }
        tables.append(Table("faults", f"Faults an object by {stratum}", "Rooms in brackets.", rows))
    terms = sorted({name for rows in scores.values() for row in rows for name in row if name.startswith("term ")})
    by_term = {
        name: [{t.removeprefix("term "): row.get(t, (0.0, row["faults"][1])) for t in terms} for row in found]
        for name, found in scores.items()
    }
    rows = figures(by_term, [term.removeprefix("term ") for term in terms], seed, first)
    return [*tables, Table("faults", "Faults an object by term", "Terms that found something somewhere.", rows)]


def selection(run: Run) -> list[Table]:
    """The counter is never the selector: searched and chosen by half A of the terms, judged by half B and a judge."""
    halves = [System(f"{s.base}+half", s.base, "half") for s in run.systems if s.finish and not s.foreign]
    halves = list(dict.fromkeys(halves))
    made: dict[str, Sequence[RoomBoxes]] = {**run_systems(halves, run.tasks, run.settings)[0]}
    made |= {system.name: run.made[system.name] for system in run.systems if not system.finish and not system.foreign}
    rows = _judged(run, made, ["told", "faults A", "faults B"])
    return [Table("selection", "Selector and counter apart", note("selection", drafts=run.settings.drafts), rows)]


def field(run: Run) -> list[Table]:
    """SceneEval's four, walkable share, fullness, and how different two layouts of one graph are."""
    scores, seed = _scored(run.made, run.of), run.settings.seed
    for name, rooms in run.made.items():
        for row, room in zip(scores[name], rooms, strict=True):
            row.update(body_scores(room, seed))
    again, _ = run_systems(run.asked, run.tasks[:ALIKE], replace(run.settings, seed=seed + AGAIN))
    for name, others in again.items():
        for row, one, other in zip(scores[name], run.made[name], others, strict=False):
            row["diversity, m"] = layout_distance(one, other), 1.0
    columns = ["colliding", "rooms colliding", "out of bounds", "navigability", "clearance", "walkable", "fullness",
               "diversity, m"]  # fmt: skip
    rows = figures(scores, columns, seed, next(iter(scores)))
    return [Table("field", "Collision, bounds, ways", note("field", alike=ALIKE), rows)]


def realism(run: Run) -> list[Table]:
    """Can rooms be told from others of the same source, and do they cover them."""
    seed, rows = run.settings.seed, {}
    real = [task.room for task in run.tasks]
    for name, rooms in run.made.items():
        paired = run.of[name] is run.tasks and name != "real"
        rows[name] = {
            "AUC, own rooms": told_apart(rooms, real, seed, paired=True) if paired else Figure(None),
            "AUC, others": told_apart(rooms, run.reference, seed),
            **set_figures(rooms, run.reference, seed),
            **{f"KS of {axis}": Figure(value) for axis, value in size_distances(rooms, run.reference).items()},
        }
    share = np.linspace(0, 1, 41)
    spread = {n: np.quantile(size_scores(rooms), share, axis=0).T for n, rooms in run.made.items() if "+" not in n}
    curves = {
        f"{axis}, standard score": {name: (at[k].tolist(), share.tolist()) for name, at in spread.items()}
        for k, axis in enumerate(AXES)
    }
    return [
        Table("realism", "Real or generated", note("realism"), rows),
        Table("realism", "Sizes", note("sizes"), {}, curves),
    ]


def pictures(run: Run) -> list[Table]:
    """Table 1: FID, KID and FID-CLIP of rooms from above by weights from the disk, and a small CNN trained here."""
    seed, rows = run.settings.seed, {}
    rooms = {**run.made, OTHERS: run.reference}
    try:
        shown = {name: np.stack([picture(room, seed) for room in made]) for name, made in rooms.items()}
    except ValueError as error:
        run.missing.append(f"pictures from above: {error}")
        return []
    seen: dict[str, dict[str, np.ndarray]] = {}
    for kind, names in NAMES.items():
        if path := getattr(run.settings, kind):
            seen[kind] = {name: features(part, kind, path) for name, part in shown.items()}
        else:
            run.missing.append(f"{' and '.join(names)} of pictures from above: --{kind} FILE, {WEIGHTS[kind]}")
    for name, made in run.made.items():
        real = "real" if run.of[name] is run.tasks and name != "real" else OTHERS
        rows[name] = {"small CNN": told_by_pictures(shown[name], shown[real], seed)}
        for word, kinds in ROOMS.items():
            of = [[k for k, r in enumerate(part) if not kinds or r.room_type in kinds] for part in (made, rooms[real])]
            for kind, found in seen.items():
                if min(map(len, of)) >= LEAST:
                    scored = picture_figures(found[name][of[0]], found[real][of[1]], NAMES[kind], seed)
                    rows[name] |= {f"{title} {word}".strip(): value for title, value in scored.items()}
    run.shown.update({name: shown[name][:SHOWN] for name in run.made})
    return [Table("pictures", "Pictures from above", note("pictures"), rows)]


def steps(run: Run) -> list[Table]:
    """What a network makes in so many steps of sampling, without a search."""
    system = next((s for s in run.systems if s.weights or s.base == "network"), System.parse("network"))
    load, seed = partial(load_model, system.weights), run.settings.seed
    made = {f"{count} steps": networks(load, steps=count)(run.tasks, seed) for count in SWEPT}
    made |= {name: list(run.made[name]) for name in ("random", "real") if name in run.made}
    rows = _judged(run, made, ["told", "faults", "physics"])
    swept = list(rows)[: len(SWEPT)]
    lines: dict[str, tuple[Sequence[float], list[str]]] = {system.base: (SWEPT, swept)}
    lines |= {name: ((SWEPT[0], SWEPT[-1]), [name] * 2) for name in rows if name not in swept}
    curves = {
        column: {name: (at, [rows[row][column].value or 0.0 for row in of]) for name, (at, of) in lines.items()}
        for column in rows[swept[0]]
    }
    return [Table("steps", "Steps of sampling", note("steps", name=system.base), rows, curves)]


def physics(run: Run) -> list[Table]:
    """Whole rooms as `generate` writes them, simulated for two seconds."""
    from echousd.make.pipeline import generate
    from echousd.settle import SettleUnavailable, settle
    from echousd.stage.boxes import graph_of

    chosen = [name for name in dict.fromkeys([run.asked[0].name, "random+search", "real"]) if name in run.made]
    scores: dict[str, list] = {name: [] for name in chosen}
    for name in chosen:
        for made in run.made[name][:SETTLED]:
            room = replace(made, yaw=np.remainder(made.yaw, 2 * np.pi))
            boxes = Boxes(*(torch.from_numpy(value).float() for value in (room.size, room.position, room.yaw)))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of what boxes of others do not keep
                whole = generate(graph_of(room, None), boxes=boxes, seed=run.settings.seed, dress="none")
            try:
                moved = settle(whole.stage).motions
            except SettleUnavailable as error:
                run.missing.append(f"physical stability: {error}")
                return []
            scores[name].append({
                "at rest": (float(sum(motion.rests for motion in moved)), float(len(moved))),
                "rooms at rest": (float(all(motion.rests for motion in moved)), 1.0),
                "furthest, m": (max((motion.shift for motion in moved), default=0.0), 1.0),
            })  # fmt: skip
    columns = ["at rest", "rooms at rest", "furthest, m"]
    rows = figures(scores, columns, run.settings.seed, chosen[0])
    return [Table("physics", "At rest", note("physics", rooms=SETTLED), rows)]


def _scored(made: Mapping[str, Sequence[RoomBoxes]], of: Mapping[str, Sequence[Task]]) -> dict[str, list[dict]]:
    return {name: list(map(layout_scores, of[name], rooms)) for name, rooms in made.items()}


def _judged(run: Run, made: Mapping[str, Sequence[RoomBoxes]], columns: Sequence[str]) -> dict[str, dict[str, Figure]]:
    """Columns of what rooms score that were made of the run's tasks, and whether they are told from real ones."""
    rows = figures(_scored(made, dict.fromkeys(made, run.tasks)), columns, run.settings.seed, next(iter(made)))
    for name, rooms in made.items():
        rows[name]["real or generated, AUC"] = told_apart(rooms, run.reference, run.settings.seed)
    return rows


RUNNERS: dict[str, Callable[[Run], list[Table]]] = {
    section.__name__: section
    for section in (relations, faults, selection, field, realism, pictures, steps, shapes, physics)
}
