"""Whoever lays out rooms, by one protocol: asked the same tasks, each room drawn from a seed of its own."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import shapely
import torch
from scipy.optimize import linear_sum_assignment

from echomodel.compact.modules import EchoLayer, silence
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch, GraphEdit
from echomodel.loading import load_model
from echomodel.metrics.furniture import usual_size
from echomodel.metrics.layouts import HALVES, Task, layout_scores
from echomodel.protocols import RoomModel
from echomodel.randomness import Randomness
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_room, generate_rooms
from echomodel.rooms.statistics import room_type_statistics
from echomodel.scene_noise import SceneGenerators
from echomodel.vocabulary import vocabulary
from echousd.graph.arrays import one_thread, seeded
from echousd.place.placing import place_boxes
from echousd.place.solver import PlaceConfig

TOGETHER = 64  # scenes in one pass of a network
POOL, POOL_SEED = 400, 910_000  # generated rooms from which `retrieval` takes
pool = cache(generate_rooms)
QUARTERS = np.pi / 2
Layouts = Callable[[Sequence[Task], int], list[RoomBoxes]]
FINISHES = {
    "search": "placed by search over all terms, as `generate` does",
    "half": "placed by search over half A of the terms; the best of the drafts by that half",
}


@dataclass(frozen=True)
class System:
    """Who lays out rooms.

    Arguments:
        name: as the command has it. base: of `BASES`, a weights file, or rooms of somebody else.
        finish: of `FINISHES`, "" = as drawn.
    """

    name: str
    base: str
    finish: str = ""

    @classmethod
    def parse(cls, text: str) -> "System":
        """From `BASE[+FINISH]`; raises ValueError for what there is not."""
        if text == "default":
            text = "network+search"
        base, plus, finish = text.partition("+")
        if plus and finish not in FINISHES:
            raise ValueError(f"{text}: finish is {finish!r}, allowed after +: {', '.join(FINISHES)}")
        if base not in BASES and not Path(base).exists():
            raise ValueError(f"{text}: no such file, folder or system, allowed: {', '.join(BASES)}, default, or a path")
        return cls(text, base, finish)

    @property
    def weights(self) -> Path | None:
        """The weights file or folder that it is, None for everything else."""
        path = Path(self.base)
        holds = path.is_dir() and any(path.glob("*.safetensors"))
        return path if self.base not in BASES and (path.suffix == ".safetensors" or holds) else None

    @property
    def foreign(self) -> Path | None:
        """The rooms from elsewhere that it is, None for what can be asked tasks."""
        return None if self.base in BASES or self.weights else Path(self.base)


def drawn(system: System, tasks: Sequence[Task], seed: int) -> list[RoomBoxes]:
    """The layouts of a system that can be asked, without its finish."""
    return (networks(partial(load_model, system.weights)) if system.weights else BASES[system.base][0])(tasks, seed)


def finished(system: System, task: Task, drafts: Sequence[RoomBoxes]) -> RoomBoxes:
    """What becomes of the drafts of one room: the best by half A of the terms, if there are several."""
    made = list(drafts)
    if system.finish:
        config = PlaceConfig(without=HALVES[1]) if system.finish == "half" else PlaceConfig()
        made = [searched(task, draft, config) for draft in drafts]

    def worth(room: RoomBoxes) -> tuple[float, ...]:
        scores = layout_scores(task, room)
        kept, stated = map(np.sum, scores["told"])
        return float(stated - kept), *(float(np.sum(scores[name][0])) for name in ("physics", "faults A"))

    return min(made, key=worth) if len(made) > 1 else made[0]


def searched(task: Task, draft: RoomBoxes, config: PlaceConfig) -> RoomBoxes:
    """A draft placed until the room keeps what is told and the objective holds."""
    with one_thread():
        done = place_boxes(
            draft.categories, draft.size, draft.position, draft.yaw, task.stated,
            floor_polygon=draft.floor_polygon if len(draft.floor_polygon) else None, height=draft.height,
            openings=draft.openings, rules=task.rules, config=config,
        )  # fmt: skip
    return replace(draft, size=done.size, position=done.position, yaw=done.yaw)


# -- networks ----------------------------------------------------------------------------------------------------------


def networks(load: Callable[[], RoomModel], guidance: float | None = 0.0, steps: int | None = None) -> Layouts:
    """Layouts by a model, many scenes at once; `guidance` of compact ones, and `steps`: None = the model's own."""

    def layouts(tasks: Sequence[Task], seed: int) -> list[RoomBoxes]:
        model, out = load(), list[RoomBoxes]()
        extra = {} if guidance is None or not isinstance(model, EchoModel) else {"relation_guidance": guidance}
        for start in range(0, len(tasks), TOGETHER):
            part = tasks[start : start + TOGETHER]
            graph, rows = GraphBatch.pack([task.graph for task in part]), [len(task.room) for task in part]
            each: Randomness = seeded(seed, "layout", start)
            if isinstance(model, EchoModel):
                each = SceneGenerators([seeded(seed, "layout", start + k) for k in range(len(part))], rows)
            with one_thread():
                found = model.sample_layout(graph, generator=each, edit=_edit(part), steps=steps, **extra).to("cpu")
            for task, one in zip(part, torch.arange(sum(rows)).split(rows), strict=True):
                boxes = found[one]  # which lie about the middle of the floor
                size, position, yaw = (np.asarray(of, float) for of in (boxes.size, boxes.position, boxes.yaw))
                position = position + task.room.centre
                out.append(replace(task.room, size=size, position=position, yaw=yaw, relations=None))
        return out

    return layouts


def _edit(tasks: Sequence[Task]) -> GraphEdit | None:
    before = [task.before for task in tasks if task.before is not None]
    if len(before) < len(tasks):
        return None
    first = np.cumsum([0, *(len(task.room) for task in tasks)])
    moved = [place + np.array([at, 0, at]) for place, at in zip(before, first, strict=False)]
    added = np.concatenate([task.added for task in tasks if task.added is not None])
    return GraphEdit(torch.from_numpy(np.concatenate(moved)), torch.from_numpy(added))


@cache
def shuffled_model(seed: int = 0) -> EchoModel:
    """The shipped weights, the numbers of each tensor in another order: an untrained network of the same sizes."""
    model = EchoModel.load()
    luck = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for value in model.model.parameters():
            value.copy_(value.flatten()[torch.randperm(value.numel(), generator=luck)].reshape(value.shape))
    return model


@cache
def muted_model() -> EchoModel:
    """The shipped weights with the echo off: in the layout branch no object hears of another."""
    model = EchoModel.load()
    for layer in model.model.layout.modules():
        if isinstance(layer, EchoLayer):
            silence(layer.message)
    return model


# -- without a network -------------------------------------------------------------------------------------------------


def room_by_room(make: Callable[[RoomBoxes, np.random.Generator], RoomBoxes], stream: int) -> Layouts:
    """Layouts of one room after the other, each by random numbers of its own."""
    return lambda tasks, seed: [
        make(task.room, np.random.default_rng([seed, stream, number])) for number, task in enumerate(tasks)
    ]


def random_places(room: RoomBoxes, rng: np.random.Generator) -> RoomBoxes:
    """Usual sizes at random places of the floor, along its walls; what hangs hangs. Chance for all that is told."""
    floor = room.floor_polygon if len(room.floor_polygon) > 2 else np.array([(-2, -2), (2, -2), (2, 2), (-2, 2)], float)
    polygon, low, high = shapely.Polygon(floor), floor.min(0), floor.max(0)
    position, yaw = np.zeros((len(room), 3)), rng.integers(4, size=len(room)) * QUARTERS
    size = np.array([usual_size(word, rng) for word in room.categories]).reshape(-1, 3)
    for k, word in enumerate(room.categories):
        for _ in range(100):
            position[k, [0, 2]] = rng.uniform(low, high)
            if polygon.contains(shapely.Point(position[k, [0, 2]])):
                break
        row = vocabulary().category(word)
        if row.support == "ceiling":
            position[k, 1] = max(room.height - size[k, 1], 0.0)
        elif row.mounted:
            position[k, 1] = row.mounted
    return replace(room, size=size, position=position, yaw=yaw, relations=None)


def generated(room: RoomBoxes, rng: np.random.Generator) -> RoomBoxes:
    """The room generator, asked for the same furniture on a floor of the same extents; what it left out is random."""
    short, long = np.sort(np.ptp(room.floor_polygon, axis=0))
    statistics = replace(
        room_type_statistics(room.room_type), short=(short,) * 5, long=(long,) * 5, height=(room.height,) * 5,
        area=tuple(short * long * np.array([0.98, 0.99, 1.0, 1.01, 1.02])),
        presence={word: (1.0, (count,), (1.0,)) for word, count in sorted(Counter(room.categories).items())},
    )  # fmt: skip
    return borrowed(room, generate_room(rng, room.room_type, statistics=statistics), rng)


def retrieved(room: RoomBoxes, rng: np.random.Generator) -> RoomBoxes:
    """The boxes of the training room whose furniture and floor are most like the asked ones; the rest is random."""
    have, extent = Counter(room.categories), np.ptp(room.floor_polygon, axis=0)

    def apart(other: RoomBoxes) -> float:
        there = Counter(other.categories)
        odd = sum((have - there).values()) + sum((there - have).values())
        return odd + float(np.abs(np.ptp(other.floor_polygon, axis=0) - extent).sum())

    return borrowed(room, min(pool(POOL, POOL_SEED), key=apart), rng)


def borrowed(room: RoomBoxes, other: RoomBoxes, rng: np.random.Generator) -> RoomBoxes:
    """The room with the boxes of another one, category by category, its floor stretched to this one's extents."""
    mine, theirs = (r.floor_polygon for r in (room, other))
    wide, other_wide = (np.ptp(floor, axis=0)[0] > np.ptp(floor, axis=0)[1] for floor in (mine, theirs))
    plan, corners, yaw = other.position[:, [0, 2]], theirs, other.yaw
    if wide != other_wide:  # turned by a quarter: x goes to z
        plan, corners, yaw = plan[:, ::-1] * [1, -1], corners[:, ::-1] * [1, -1], yaw + QUARTERS
    stretch = np.ptp(mine, axis=0) / np.maximum(np.ptp(corners, axis=0), 1e-6)
    plan = (plan - (corners.max(0) + corners.min(0)) / 2) * stretch + (mine.max(0) + mine.min(0)) / 2
    made = random_places(room, rng)
    size, position, heading = made.size.copy(), made.position.copy(), made.yaw.copy()
    words, others = np.array(room.categories, dtype=object), np.array(other.categories, dtype=object)
    for word in sorted(set(room.categories)):
        here, there = np.flatnonzero(words == word), np.flatnonzero(others == word)
        cost = np.linalg.norm(position[here][:, None, [0, 2]] - plan[there][None], axis=-1)
        for k, j in zip(*linear_sum_assignment(cost), strict=True):
            at, source = here[k], there[j]
            size[at], heading[at] = other.size[source], yaw[source]
            position[at] = (plan[source, 0], other.position[source, 1], plan[source, 1])
    return replace(made, size=size, position=position, yaw=heading)


BASES: dict[str, tuple[Layouts, str]] = {  # name -> who, and what it is in a few words
    "network": (networks(load_model), "the compact network from noise, unguided"),
    "guided": (networks(load_model, None), "the same, moved down what the terms miss, late and afterwards"),
    "shuffled": (
        networks(shuffled_model),
        "the same network, the numbers of each of its tensors in another order: untrained",
    ),
    "muted": (networks(muted_model), "the shipped network with its echo off: no object hears of another"),
    "generator": (room_by_room(generated, 8), "the room generator, asked for the same furniture on such a floor"),
    "random": (room_by_room(random_places, 7), "usual sizes at random places: chance"),
    "retrieval": (room_by_room(retrieved, 9), f"boxes of the most similar of {POOL} rooms like those of the training"),
    "real": (lambda tasks, seed: [task.room for task in tasks], "the true boxes"),
}


def described(system: System) -> str:
    """What a system is, in a few words."""
    base = "weights" if system.weights else "rooms from elsewhere" if system.foreign else BASES[system.base][1]
    return base + (f"; {FINISHES[system.finish]}" if system.finish else "")
