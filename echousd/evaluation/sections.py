"""The sections of a suite: each makes its tables of one run."""

import re
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
import trimesh
from pxr import Usd

from echomodel.boxes import Boxes
from echomodel.data.shapeset import ShapeSet
from echomodel.echo import EchoModel
from echomodel.furniture import draw_choices, draw_style, mesh_of, solids
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.loading import load_model
from echomodel.metrics.furniture import piece_scores, sampled, style_scores, usual_size
from echomodel.metrics.layouts import (
    GROUPS,
    Task,
    changed,
    extended,
    kept_relations,
    layout_scores,
    strata_of,
    tasks_of,
)
from echomodel.metrics.pictures import WEIGHTS, body_scores, cnn_accuracy, features, picture, picture_figures
from echomodel.metrics.pointsets import chamfer, set_scores, surface_points
from echomodel.metrics.sets import AXES, forest_auc, layout_distance, set_figures, size_distances, size_scores
from echomodel.metrics.statistics import Counts, Figure, figure, mean
from echomodel.protocols import RoomModel
from echomodel.roomboxes import RoomBoxes
from echomodel.tsdf import mesh_from_tsdf
from echomodel.vocabulary import vocabulary
from echousd.draw.drawables import read_drawables
from echousd.evaluation.runs import Run, Table, figures, note, run_systems
from echousd.evaluation.systems import System, networks, shuffled_model
from echousd.make.finished import Room
from echousd.stage.boxes import graph_of
from echousd.stage.paths import DRESSING

AGAIN, TWICE = 1, 8  # added to the seed for a second layout of the same graph; rooms that are laid out twice
OTHERS = "other rooms"  # of the source
NAMES = {"inception": ("FID", "KID x 1000"), "clip": ("FID-CLIP",)}
ROOMS: dict[str, tuple[str, ...]] = {  # of the paper: a living and dining room counts as both; all of them
    "": (), "bedroom": ("bedroom",), "living_room": ("living_room", "living_dining_room"),
    "dining_room": ("dining_room", "living_dining_room"),
}  # fmt: skip
LEAST, SHOWN = 4, 6  # rooms of a type that have a figure of their own; that are shown
SWEPT = (2, 5, 10, 20, 50)  # steps of sampling
SETTLED, DRESSED = 4, 50  # rooms that are simulated, that are dressed


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
    tables = [Table("faults", "Faults an object", note("faults", stated=run.settings.relations), rows)]
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
    again, _ = run_systems(run.asked, run.tasks[:TWICE], replace(run.settings, seed=seed + AGAIN))
    for name, others in again.items():
        for row, one, other in zip(scores[name], run.made[name], others, strict=False):
            row["diversity, m"] = layout_distance(one, other), 1.0
    columns = ["colliding", "rooms colliding", "out of bounds", "navigability", "clearance", "walkable", "fullness",
               "diversity, m"]  # fmt: skip
    rows = figures(scores, columns, seed, next(iter(scores)))
    return [Table("field", "Collision, bounds, ways", note("field", alike=TWICE), rows)]


def realism(run: Run) -> list[Table]:
    """Can rooms be told from others of the same source, and do they cover them."""
    seed, rows = run.settings.seed, {}
    real = [task.room for task in run.tasks]
    for name, rooms in run.made.items():
        paired = run.of[name] is run.tasks and name != "real"
        rows[name] = {
            "AUC, own rooms": forest_auc(rooms, real, seed, paired=True) if paired else Figure(None),
            "AUC, others": forest_auc(rooms, run.reference, seed),
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
        rows[name] = {"small CNN": cnn_accuracy(shown[name], shown[real], seed)}
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
    from echousd.settle.settle import SettleUnavailable, settle

    chosen = [name for name in dict.fromkeys([run.asked[0].name, "random+search", "real"]) if name in run.made]
    scores: dict[str, list] = {name: [] for name in chosen}
    for name in chosen:
        for made in run.made[name][:SETTLED]:
            try:
                moved = settle(_generated(made, run.settings.seed, "none").stage).motions
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


PRINT, ALIKE = re.compile("(?:picture|rug|cushion)_.*"), 0.02  # how a print's material ends; of a shape's extents


def repetition(run: Run) -> list[Table]:
    """How often the same small thing is met in the rooms of a system, each dressed by a seed of its own."""
    seed, rows = run.settings.seed, dict[str, dict[str, Figure]]()
    for name in (name for name in dict.fromkeys([run.asked[0].name, "real"]) if name in run.made):
        rooms = [things(_generated(room, seed + k, "full").stage) for k, room in enumerate(run.made[name][:DRESSED])]
        met = Counter(thing for room in rooms for thing in room)
        again = [(sum(met[thing] - 1 for thing in room) / max(len(rooms) - 1, 1), float(len(room))) for room in rooms]
        most = {"different things": len(met), "rooms with the most frequent": max(met.values(), default=0)}
        rows[name] = {"met again": figure(Counts.of(again), seed)} | {key: Figure(float(most[key])) for key in most}
    return [Table("repetition", "Small things met again", note("repetition"), rows)]


def things(stage: Usd.Stage) -> set[tuple[str, ...]]:
    """The different small things of a room: label and prints, without prints the shape in a box of one metre."""
    found = set[tuple[str, ...]]()
    for mesh in (mesh for mesh in read_drawables(stage) if mesh.path.startswith(f"{DRESSING}/")):
        prints = {name[0] for paint, _ in mesh.paints if (name := PRINT.search(paint.name))}
        corners = mesh.triangles.reshape(-1, 3) - mesh.triangles.min((0, 1))
        shape = np.round(corners / np.maximum(corners.max(0), 1e-6) / ALIKE).astype(int).tobytes()
        found.add((mesh.category, *(sorted(prints) or [f"shape {hash(shape):x}"])))
    return found


def _generated(made: RoomBoxes, seed: int, dress: str) -> Room:
    """A room as `generate` makes it around boxes."""
    from echousd.make.pipeline import generate

    room = replace(made, yaw=np.remainder(made.yaw, 2 * np.pi))
    boxes = Boxes(*(torch.from_numpy(value).float() for value in (room.size, room.position, room.yaw)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what boxes of others do not keep
        return generate(graph_of(room, None), boxes=boxes, seed=seed, dress=dress)


def _scored(made: Mapping[str, Sequence[RoomBoxes]], of: Mapping[str, Sequence[Task]]) -> dict[str, list[dict]]:
    return {name: list(map(layout_scores, of[name], rooms)) for name, rooms in made.items()}


def _judged(run: Run, made: Mapping[str, Sequence[RoomBoxes]], columns: Sequence[str]) -> dict[str, dict[str, Figure]]:
    """Columns of what rooms score that were made of the run's tasks, and whether they are told from real ones."""
    rows = figures(_scored(made, dict.fromkeys(made, run.tasks)), columns, run.settings.seed, next(iter(made)))
    for name, rooms in made.items():
        rows[name]["real or generated, AUC"] = forest_auc(rooms, run.reference, run.settings.seed)
    return rows


PUBLISHED = (  # classes of the paper's Tables 3 and 6, in our words
    "double_bed", "nightstand", "wardrobe", "dining_chair", "dining_table", "cabinet", "floor_lamp", "shelf",
    "multi_seat_sofa", "tv_stand",
)  # fmt: skip
CONSISTENT = ("wardrobe", "nightstand", "dining_chair", "dining_table")  # classes of Table 3
POINTS, MOVED = 1024, 128  # points of a shape, and of those that the earth mover's distance looks at
SUITES, PAIRS = 24, 6  # of four classes told one style; of one class
DISTANCES = {"Chamfer": 0, "EMD": MOVED}
FIGURES = {"mmd": "MMD", "cov": "COV", "acc": "1-NNA", "variety": "variety"}
Pieces = Sequence[tuple[trimesh.Trimesh, dict[str, float]]]


def shapes(run: Run) -> list[Table]:
    """Tables 3 and 6: MMD, COV, 1-NNA by Chamfer and earth mover's distance, and whether told styles agree."""
    seed, count = run.settings.seed, max(4, min(12, run.settings.count // 2))
    rng = np.random.default_rng([seed, 20])
    sizes = {word: np.stack([usual_size(word, rng) for _ in range(count)]) for word in PUBLISHED}
    models: dict[str, RoomModel] = {"network": EchoModel.load(), "shuffled": shuffled_model()}
    models |= {s.name: load_model(s.weights) for s in run.systems if s.weights and not s.finish}
    models = {name: model for name, model in models.items() if model.branches & {"shape", "furniture"}}
    made: dict[str, Mapping[str, Sequence[trimesh.Trimesh]]] = {}
    rows: dict[str, dict[str, Figure]] = {}
    for name, model in models.items():
        found = {word: pieces(model, [[word]] * count, sizes[word], seed) for word in PUBLISHED}
        made[name] = {word: [mesh for mesh, _ in row] for word, row in found.items()}
        scores = [score for row in found.values() for _, score in row]
        rows[name] = {
            key: mean([score[key] for score in scores], seed) for key in ("closed", "loose") if key in scores[0]
        }
    made["retrieval"] = {word: row[::-1] for word, row in programs(sizes, [seed, 21, 0]).items()}
    made["random"] = {word: [trimesh.creation.box(size) for size in sizes[word]] for word in PUBLISHED}
    made["programs"] = programs(sizes, [seed, 21, 1])
    against = {word: clouds(row) for word, row in programs(sizes, [seed, 21, 2]).items()}
    if run.settings.shapes:
        against = _set_clouds(Path(run.settings.shapes), count, seed)
    ours = {name: {word: clouds(row[word]) for word in against} for name, row in made.items()}
    scored = {
        (name, distance): set_scores(by_class, against, points=points)
        for name, by_class in ours.items() for distance, points in DISTANCES.items()
    }  # fmt: skip
    for (name, distance), by_class in scored.items():
        for key, title in FIGURES.items():
            rows.setdefault(name, {})[f"{title}, {distance}"] = mean([row[key] for row in by_class.values()], seed)
    text = note("shapes", count=count, against=run.settings.shapes or "pieces of the programs drawn anew")
    tables = [Table("shapes", "Shapes", text, {name: rows[name] for name in made})]
    for key in ("mmd", "cov", "acc"):
        for distance in DISTANCES:
            by = {name: {word: Figure(row[key]) for word, row in scored[name, distance].items()} for name in made}
            tables.append(Table("shapes", f"{FIGURES[key]} by class, {distance}", "As above.", by, plain=True))
    return [*tables, _consistency(models, sizes, seed)]


def pieces(model: RoomModel, scenes: Sequence[Sequence[str]], sizes: np.ndarray, seed: int, stated: str = "") -> Pieces:
    """The furniture of scenes that a model makes, with its scores where it is written in parts.

    Arguments:
        scenes: categories of each. sizes: (N, 3) metres. told: predicate that joins all of a scene, "" = none.
    """
    predicate = vocabulary().predicate_id(stated) if stated else 0
    graph = GraphBatch.pack([
        GraphBatch.single(
            [vocabulary().category_id(word) for word in scene],
            [(i, predicate, j) for i in range(len(scene)) for j in range(len(scene)) if stated and i != j],
        )
        for scene in scenes
    ])  # fmt: skip
    generator, words = torch.Generator().manual_seed(seed), [word for scene in scenes for word in scene]
    if "furniture" in model.branches:
        found = sampled(model, graph, sizes, generator).numpy()
        rows = zip(words, found, sizes, strict=True)
        return [piece_scores(solids(word, *piece_of(vector), size), size) for word, vector, size in rows]
    boxes = Boxes(torch.from_numpy(sizes).float(), torch.zeros(len(sizes), 3), torch.zeros(len(sizes)))
    return [(_mesh(grid), {}) for grid in model.sample_shapes(graph, boxes, generator=generator).numpy(force=True)]


def _mesh(grid: np.ndarray) -> trimesh.Trimesh:
    try:
        return mesh_from_tsdf(grid)
    except ValueError:  # without a surface, as untrained networks write them
        return trimesh.creation.box((1, 1, 1))


def programs(sizes: Mapping[str, np.ndarray], seed: Sequence[int]) -> dict[str, list[trimesh.Trimesh]]:
    """Pieces of the programs, drawn anew for every seed."""
    luck = np.random.default_rng(list(seed))
    return {
        word: [mesh_of(solids(word, draw_style(luck), draw_choices(luck), size), size) for size in rows]
        for word, rows in sizes.items()
    }


def clouds(meshes: Sequence[trimesh.Trimesh]) -> np.ndarray:
    """(n, POINTS, 3) float32 points on the surfaces in the unit box."""
    units = [trimesh.Trimesh((m.vertices - m.bounds[0]) / m.extents - 0.5, m.faces, process=False) for m in meshes]
    return np.stack([surface_points(unit, POINTS) for unit in units])


def _consistency(models: Mapping[str, RoomModel], sizes: Mapping[str, np.ndarray], seed: int) -> Table:
    """Table 3: Chamfer distances of pieces of one class that are told to be of one style."""
    rows: dict[str, dict[str, Figure]] = {}
    for name, model in {**models, "independent shapes": models["network"]}.items():
        stated = "same_style_as" if name in models else ""
        rows[name] = _styles(model, bool(stated), seed) if "furniture" in model.branches else {}
        for word in CONSISTENT:
            doubled = np.repeat(sizes[word][:PAIRS], 2, axis=0)
            scenes = [[word] * 2] * (len(doubled) // 2) if stated else [[word]] * len(doubled)
            found = torch.from_numpy(clouds([mesh for mesh, _ in pieces(model, scenes, doubled, seed, stated)]))
            apart = [1000 * float(chamfer(one, found[2 * k + 1 :][:1])) for k, one in enumerate(found[::2])]
            rows[name][f"{word} x 1000"] = mean(apart, seed)
    rows["random"] = {f"{word} x 1000": Figure(0.0) for word in CONSISTENT}
    return Table("shapes", "Consistency", note("consistency"), rows)


def _styles(model: RoomModel, together: bool, seed: int) -> dict[str, Figure]:
    generator = torch.Generator().manual_seed(seed)

    def drawn(graph: GraphBatch, wanted: np.ndarray) -> torch.Tensor:
        alone = [GraphBatch.single([category]) for category in graph.category.tolist()]
        return sampled(model, graph if together else GraphBatch.pack(alone), wanted, generator)

    found = style_scores(drawn, len(vocabulary().categories), SUITES, seed)
    return {f"style distance, {key}": Figure(value) for key, value in found.items()}


def _set_clouds(folder: Path, count: int, seed: int) -> dict[str, np.ndarray]:
    found = ShapeSet(folder / "shapes" if (folder / "shapes").is_dir() else folder)
    rng, out = np.random.default_rng([seed, 22]), {}
    for word in PUBLISHED:
        if word in found.categories:
            chosen = rng.permutation(np.flatnonzero(found.category == found.categories.index(word)))[:count]
            out[word] = clouds([mesh_from_tsdf(found[int(i)]) for i in chosen])
    return out


RUNNERS: dict[str, Callable[[Run], list[Table]]] = {
    section.__name__: section
    for section in (relations, faults, selection, field, realism, pictures, steps, shapes, physics, repetition)
}
