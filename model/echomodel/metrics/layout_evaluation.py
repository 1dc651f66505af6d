"""Layout evaluation: label rooms by rule, drop edges, have boxes sampled, score them; also after edits of the graph."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor, nn

from echomodel.boxes import Boxes
from echomodel.compact.draft import measurable, seen_from, wall_features
from echomodel.floors import centred
from echomodel.graph import GraphBatch
from echomodel.metrics.room_figures import room_figures, with_known_words
from echomodel.objective import BY_EYE, TERMS, faults_of, plan_of, unreached, walk
from echomodel.progress import StepListener
from echomodel.roomboxes import RoomBoxes
from echomodel.rules import label_rooms, verdicts
from echomodel.rules.geometry import BoxesLike
from echomodel.rules.telling import told_relations
from echomodel.sizes import size_score
from echomodel.vocabulary import vocabulary

VARIED = 30  # rooms, spread over all, whose layouts are compared with one another
# Predicates that an evaluation changes, and into what (SPEC: the four pairs of opposites).
OPPOSITE = {1: 2, 2: 1, 3: 4, 4: 3, 8: 9, 9: 8, 10: 11, 11: 10}


@dataclass(frozen=True, eq=False)
class EditedGraph:
    """Scenes to sample, with what was edited in them.

    Arguments:
        graph: the scenes after the edit.
        before: (E, 3) int64 triplets before the edit, None where there was none.
        added: (N,) bool, nodes that came in. touched: (N,) bool, nodes that an edit concerns.
        known, known_mask: N boxes and (N,) bool, boxes that are given, None where none is.
    """

    graph: GraphBatch
    before: Tensor | None
    added: Tensor
    touched: Tensor
    known: Boxes | None = None
    known_mask: Tensor | None = None


LayoutSource = Callable[[EditedGraph], Boxes]
Finish = Callable[[RoomBoxes, Tensor], tuple[RoomBoxes, tuple[int, ...]]]


@dataclass(frozen=True)
class LayoutEvaluation:
    """How to evaluate.

    Arguments:
        rules: `strict` or `sgfront`, for labels and scores.
        drop: share of the labelled edges that the graph does not tell.
        told: relations an object that the graph tells, of the nearest pairs first, in place of `drop`; then what a
            person would point at is counted too.
        seed: of the dropping and the edits.
        change, add: also score after one relation per scene was turned round, after one node per scene was added.
        complete: also score with half of the true boxes given.
        contradictions: keep what contradicts a changed relation, as the published evaluation does.
        scenes: scenes in a batch.
        judge: also let a judge tell the layouts from the true ones.
        drafts: layouts of each room that are finished at most, of which the best is kept.
        seeds: of `VARIED` rooms, spread over all of them, layouts to compare with one another; 0 = none.
    """

    rules: str = "strict"
    drop: float = 0.5
    seed: int = 0
    change: bool = False
    add: bool = False
    complete: bool = False
    contradictions: bool = False
    scenes: int = 64
    told: float | None = None
    judge: bool = False
    drafts: int = 1
    seeds: int = 0


def evaluate_layout(
    rooms: Sequence[RoomBoxes],
    sample: LayoutSource,
    settings: LayoutEvaluation = LayoutEvaluation(),
    progress: StepListener | None = None,
    finish: Finish | None = None,
) -> dict:
    """Score boxes that `sample` makes for the graphs of `rooms`.

    Arguments:
        rooms: true rooms of any source; words that the vocabulary does not hold are left out, as are rooms with fewer
            than two objects.
        sample: gives the N boxes of some scenes, in the order of their nodes.
        settings: rules, dropping, edits.
        progress: called with (scenes done, in all).
        finish: what becomes of a draft of a room and the (e, 3) relations told of it, placing for instance, and how
            many faults that has, the worse ones first; rooms without any are drafted no further.

    Returns:
        `rooms` scored, `settings`, `generation` (and `change`, `add`, `complete`): shares of relations kept per
        predicate and group, for edits also of the triplets that touch an edited (or free) node and of the others;
        `sizes`: rows per class and axis; `figures` and `real_figures`: collisions, outside floor, pairs, walls, in the
        form of `room_statistics.json`; with `told` also `living` and `real_living` (`living_evaluation.living_scores`);
        `judge`: how often it is right about the layouts; `variety`, see `variety_scores`.
    """
    rooms = [room for room in with_known_words(rooms) if len(room) > 1]
    if not rooms:
        raise ValueError("no room with two or more known objects to evaluate")
    rng = np.random.default_rng(settings.seed)
    graphs = told_graphs(rooms, settings, rng)
    modes = ["generation"] + ["change"] * settings.change + ["add"] * settings.add + ["complete"] * settings.complete
    done, total = 0, len(rooms) * len(modes)
    out: dict = {"rooms": len(rooms), "settings": asdict(settings)}
    drawn: list[RoomBoxes] = []
    for mode in modes:
        found, scenes, edits, offset = [], [], [], 0
        for start in range(0, len(rooms), settings.scenes):
            part = slice(start, start + settings.scenes)
            edited = _edited(graphs[part], rooms[part], mode, rng, settings)
            boxes = sample(edited)
            if len(boxes) != edited.graph.num_nodes:
                raise ValueError(f"the sampler gave {len(boxes)} boxes for {edited.graph.num_nodes} nodes")
            if mode == "generation":
                made = _rooms_of(rooms[part], edited.graph, boxes)
                if finish is not None:
                    made = _finished(made, rooms[part], graphs[part], sample, finish, settings.drafts)
                    boxes = Boxes.cat([Boxes.from_room(room) for room in made])
                drawn += made
            found.append(boxes.to("cpu"))
            scenes.append(edited.graph.triplets + torch.tensor([offset, 0, offset]))
            edits.append(edited.touched)
            offset += edited.graph.num_nodes
            done += len(rooms[part])
            if progress:
                progress(done, total)
        out[mode] = _scores(Boxes.cat(found), torch.cat(scenes), torch.cat(edits), mode, settings.rules)
    out.update(_distributions(drawn, rooms))
    if settings.told is not None:
        told = [graph.triplets.numpy() for graph in graphs]
        out["living"], out["real_living"] = living_scores(drawn, told), living_scores(rooms, told)
    if settings.judge:
        out["judge"] = {"here": judged(rooms, drawn)}
    if settings.seeds:

        def boxes_of(graph: GraphBatch) -> Boxes:
            none = torch.zeros(graph.num_nodes, dtype=torch.bool)
            return sample(EditedGraph(graph, None, none, none))

        some = [graphs[number * len(graphs) // VARIED] for number in range(VARIED)] if len(graphs) > VARIED else graphs
        out["variety"] = variety_scores(some, boxes_of, settings.seeds)
    return out


def _finished(
    drawn: Sequence[RoomBoxes],
    rooms: Sequence[RoomBoxes],
    graphs: Sequence[GraphBatch],
    sample: LayoutSource,
    finish: Finish,
    drafts: int,
) -> list[RoomBoxes]:
    """The best of so many drafts of each room, `drawn` being the first; others are drawn only of rooms with faults."""
    best = [finish(room, graph.triplets) for room, graph in zip(drawn, graphs, strict=True)]
    for _ in range(drafts - 1):
        open_ = [number for number, (_, faults) in enumerate(best) if any(faults)]
        if not open_:
            break
        graph = GraphBatch.pack([graphs[number] for number in open_])
        none = torch.zeros(graph.num_nodes, dtype=torch.bool)
        more = _rooms_of([rooms[number] for number in open_], graph, sample(EditedGraph(graph, None, none, none)))
        for number, room in zip(open_, more, strict=True):
            best[number] = min(best[number], finish(room, graphs[number].triplets), key=lambda one: one[1])
    return [room for room, _ in best]


def told_graphs(rooms: Sequence[RoomBoxes], settings: LayoutEvaluation, rng: np.random.Generator) -> list[GraphBatch]:
    """The graph of each room with the relations that the settings tell of it."""
    drop = settings.drop if settings.told is None else 0.0
    labels = [torch.from_numpy(edges) for edges in label_rooms(rooms, rules=settings.rules, drop=drop, rng=rng)]
    if settings.told is not None:
        luck = torch.Generator().manual_seed(settings.seed)
        pairs = zip(labels, rooms, strict=True)
        labels = [told_relations(edges, room, settings.told, luck) for edges, room in pairs]
    return [GraphBatch.from_room(room, triplets=edges) for room, edges in zip(rooms, labels, strict=True)]


def _scores(boxes: Boxes, triplets: Tensor, touched: Tensor, mode: str, rules: str) -> dict:
    scores = relation_scores(boxes, triplets, rules=rules).to_json()
    if mode != "generation":
        near = touched_triplets(triplets, touched)
        scores["edited"] = relation_scores(boxes, triplets, rules=rules, subset=near).to_json()
        scores["untouched"] = relation_scores(boxes, triplets, rules=rules, subset=~near).to_json()
    return scores


def _edited(
    graphs: Sequence[GraphBatch],
    rooms: Sequence[RoomBoxes],
    mode: str,
    rng: np.random.Generator,
    settings: LayoutEvaluation,
) -> EditedGraph:
    """Pack scenes, each with one random edit of the given kind, or half of its boxes given."""
    packed = GraphBatch.pack(graphs)
    none = torch.zeros(packed.num_nodes, dtype=torch.bool)
    if mode == "generation":
        return EditedGraph(packed, None, none, none)
    if mode == "complete":
        given = torch.from_numpy(rng.random(packed.num_nodes) < 0.5)
        return EditedGraph(packed, None, none, ~given, Boxes.cat([Boxes.from_room(room) for room in rooms]), given)
    touched, added = none.clone(), none.clone()
    after, before, first = [], [], 0
    for graph in graphs:
        shift = torch.tensor([first, 0, first])
        if mode == "change":
            old, new, ends = _change(graph.triplets, rng, settings.contradictions)
            touched[[first + end for end in ends]] = True
        else:
            node = int(rng.integers(graph.num_nodes))
            ends = [node]
            old, new = graph.triplets[(graph.triplets[:, [0, 2]] != node).all(1)], graph.triplets
            added[first + node] = touched[first + node] = True
        after.append(new + shift)
        before.append(old + shift)
        first += graph.num_nodes
    return EditedGraph(packed.with_triplets(torch.cat(after)), torch.cat(before), added, touched)


def _change(triplets: Tensor, rng: np.random.Generator, contradictions: bool) -> tuple[Tensor, Tensor, list[int]]:
    """Turn one relation round: the triplets before and after, and the two ends (none where nothing can be turned)."""
    can = np.flatnonzero(np.isin(triplets[:, 1].numpy(), list(OPPOSITE)))
    if not len(can):
        return triplets, triplets, []
    chosen = int(can[rng.integers(len(can))])
    subject, predicate, object_ = triplets[chosen].tolist()
    after = triplets.clone()
    after[chosen, 1] = OPPOSITE[predicate]
    if not contradictions:
        # The mirrored edge says what no longer holds.
        wrong = (after == torch.tensor([object_, OPPOSITE[predicate], subject])).all(1)
        after = after[~wrong]
    return triplets, after, [subject, object_]


def _rooms_of(rooms: Sequence[RoomBoxes], graph: GraphBatch, boxes: Boxes) -> list[RoomBoxes]:
    """The true rooms with the sampled boxes in place of theirs."""
    out, first = [], 0
    for room in rooms:
        last = first + len(room)
        centre = np.zeros(3)
        if len(room.floor_polygon):
            centre[[0, 2]] = (room.floor_polygon.min(0) + room.floor_polygon.max(0)) / 2
        part = (boxes.size, boxes.position, boxes.yaw)
        size, position, yaw = (field[first:last].detach().cpu().numpy().astype(float) for field in part)
        out.append(replace(room, size=size, position=position + centre, yaw=yaw, relations=None))
        first = last
    return out


def _distributions(drawn: Sequence[RoomBoxes], rooms: Sequence[RoomBoxes]) -> dict:
    def joined(of: Sequence[RoomBoxes]) -> tuple[list[str], np.ndarray]:
        return [word for room in of for word in room.categories], np.concatenate([room.size for room in of])

    words = {category.name for category in vocabulary().categories}
    rows = size_rows(*joined(drawn), *joined(rooms))
    return {
        "sizes": [asdict(row) for row in rows if row.category in words],
        "figures": room_figures(drawn),
        "real_figures": room_figures(rooms),
    }


def variety_scores(graphs: Sequence[GraphBatch], sample: Callable[[GraphBatch], Boxes], seeds: int) -> dict:
    """Mean distance between layouts of one graph (`layout_distance`).

    Arguments:
        graphs: of one scene each. sample: boxes of packed scenes. seeds: layouts of each graph.

    Returns:
        `here`: metres; `rooms`, `seeds`: how many.
    """
    here = [variety(sample(GraphBatch.pack([graph] * seeds)), graph, seeds) for graph in graphs]
    return {"here": float(np.mean(here)), "rooms": len(here), "seeds": seeds}


def variety(boxes: Boxes, graph: GraphBatch, count: int) -> float:
    """Mean distance of all pairs of `count` layouts of one graph that lie behind one another in `boxes`, metres."""
    places = boxes.position[:, [0, 2]].detach().cpu().double().numpy().reshape(count, graph.num_nodes, 2)
    category = graph.category.cpu().numpy()
    return float(np.mean([layout_distance(places[i], places[k], category) for i in range(count) for k in range(i)]))


def layout_distance(one: np.ndarray, other: np.ndarray, category: np.ndarray) -> float:
    """Mean distance in plan between the pieces of two layouts of the same furniture, metres; equal pieces may swap.

    Arguments:
        one, other: (n, 2) float, metres. category: (n,) int.
    """
    total = 0.0
    for number in np.unique(category):
        mine = category == number
        apart = np.linalg.norm(one[mine][:, None] - other[mine][None], axis=-1)
        total += float(apart[linear_sum_assignment(apart)].sum())
    return total / max(len(one), 1)


def living_scores(rooms: Sequence[RoomBoxes], relations: Sequence[np.ndarray]) -> dict:
    """Faults by the living rules.

    Arguments:
        rooms: in the vocabulary's words. relations: (e, 3) int of each, what its graph tells.

    Returns:
        `per_object`, faults an object; `free_of_faults`, share of rooms without any; `walkable`, mean share of the free
        floor that is reached from the door; `rules`, faults an object of every rule that found one.
    """
    found: Counter[str] = Counter()
    free, shares, objects = 0, [], 0
    for room, edges in zip(rooms, relations, strict=True):
        plan = plan_of(room, room.categories, room.floor_polygon, room.openings, edges)
        seen = faults_of(plan) + unreached(plan)
        found.update(fault.rule for fault in seen)
        free += not seen
        objects += len(room)
        walked = walk(plan)
        if walked is not None:
            shares.append(walked.share)
    return {
        "per_object": sum(found.values()) / max(objects, 1),
        "free_of_faults": free / max(len(rooms), 1),
        "walkable": float(np.mean(shares)) if shares else None,
        "rules": {name: count / max(objects, 1) for name, count in found.most_common()},
        "measured": sum(term.kind in BY_EYE for term in TERMS) + 1,
    }


WIDTH, STEPS, RATE, DECAY = 48, 160, 3e-3, 3e-3
RUNS = 4  # half of them each way round
NEIGHBOURS = 5  # of each object that are looked at
SCORES = 3.0  # standard scores beyond which a size is told no further


class _Judge(nn.Module):
    """Looks at every object and at every pair of a room, and pools what it saw."""

    def __init__(self, own: int, pair: int) -> None:
        super().__init__()
        classes = len(vocabulary().categories)
        self.word = nn.Embedding(classes, 12)
        self.own = nn.Sequential(nn.Linear(own + 12, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH), nn.SiLU())
        self.pair = nn.Sequential(nn.Linear(pair + 24, WIDTH), nn.SiLU(), nn.Linear(WIDTH, WIDTH), nn.SiLU())
        self.says = nn.Sequential(nn.Dropout(0.3), nn.Linear(4 * WIDTH, WIDTH), nn.SiLU(), nn.Linear(WIDTH, 1))

    def forward(self, rooms: _Packed) -> Tensor:
        words = self.word(rooms.category)
        own = self.own(torch.cat([rooms.own, words], 1))
        pair = self.pair(torch.cat([rooms.pair, words[rooms.ends[:, 0]], words[rooms.ends[:, 1]]], 1))
        seen = [_pooled(own, rooms.scene, rooms.count), _pooled(pair, rooms.scene[rooms.ends[:, 0]], rooms.count)]
        return self.says(torch.cat(seen, 1))[:, 0]


class _Packed:
    """Rooms as features of their objects (N, F) and ordered pairs (P, G)."""

    def __init__(self, rooms: Sequence[RoomBoxes]) -> None:
        words = vocabulary()
        own, pair, ends, category, first = [], [], [], [], 0
        for room in rooms:
            boxes = measurable(Boxes.from_room(room))
            floor = centred(room.floor_polygon if len(room.floor_polygon) else None)[None].expand(len(room), -1, -1)
            scores = [size_score(word, room.size[k : k + 1])[0] for k, word in enumerate(room.categories)]
            lift = boxes.position[:, 1:2]
            told = torch.from_numpy(np.array(scores)).float().clamp(-SCORES, SCORES)
            own.append(torch.cat([wall_features(boxes, floor), told, torch.tanh(lift), torch.tanh(20 * lift)], 1))
            near = _neighbours(boxes)
            pair.append(near[1])
            ends.append(near[0] + first)
            category += [words.category_id(word) for word in room.categories]
            first += len(room)
        self.own, self.pair, self.ends = torch.cat(own), torch.cat(pair), torch.cat(ends)
        self.category, self.count = torch.tensor(category), len(rooms)
        self.scene = torch.arange(len(rooms)).repeat_interleave(torch.tensor([len(room) for room in rooms]))


def judged(real: Sequence[RoomBoxes], made: Sequence[RoomBoxes], seed: int = 0) -> float:
    """How often the judge is right about rooms that it was not trained on: 0.5 = it cannot tell them apart.

    Trained on every other pair of rooms, tested on the rest, and the other way round.

    Arguments:
        real, made: n rooms each, of the same furniture in the same order, in the vocabulary's words.
    """
    parts = [[_Packed([*real[k::2], *made[k::2]]), len(real[k::2])] for k in (0, 1)]
    right = [_accuracy(parts[run % 2], parts[1 - run % 2], seed + run) for run in range(RUNS)]
    return float(np.mean(right))


def _accuracy(train: list, test: list, seed: int) -> float:
    (rooms, count), (others, number) = train, test
    with torch.random.fork_rng(), torch.enable_grad():
        torch.manual_seed(seed)
        judge = _Judge(rooms.own.shape[1], rooms.pair.shape[1])
        optimizer = torch.optim.AdamW(judge.parameters(), lr=RATE, weight_decay=DECAY)
        truth = (torch.arange(rooms.count) < count).float()
        for _ in range(STEPS):
            loss = nn.functional.binary_cross_entropy_with_logits(judge(rooms), truth)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
    with torch.no_grad():
        said = judge.eval()(others) > 0
    return float((said == (torch.arange(others.count) < number)).float().mean())


def _neighbours(boxes: Boxes) -> tuple[Tensor, Tensor]:
    """Each object with its nearest ones, (P, 2), and how those stand in its frame, (P, 13)."""
    apart = torch.cdist(boxes.position[:, [0, 2]], boxes.position[:, [0, 2]]).fill_diagonal_(torch.inf)
    j = apart.topk(min(NEIGHBOURS, len(boxes) - 1), largest=False).indices
    i, j = torch.arange(len(boxes)).repeat_interleave(j.shape[1]), j.flatten()
    turn = boxes.yaw[j] - boxes.yaw[i]
    told = torch.cat([seen_from(boxes, i, j), torch.stack([turn.sin(), turn.cos(), (4 * turn).sin()], 1)], 1)
    return torch.stack([i, j], 1), told


def _pooled(seen: Tensor, scene: Tensor, count: int) -> Tensor:
    """Mean and largest of what was seen of each room: (M, W) -> (S, 2 W)."""
    many = torch.zeros(count, 1).index_add_(0, scene, torch.ones(len(scene), 1)).clamp_min(1)
    mean = torch.zeros(count, seen.shape[1]).index_add(0, scene, seen) / many
    most = torch.zeros(count, seen.shape[1]).scatter_reduce(0, scene[:, None].expand_as(seen), seen, "amax")
    return torch.cat([mean, most], 1)


# The groups of the published table; `above` is ours, the published code does not measure it.
GROUPS = {
    "left/right": ("left", "right"),
    "front/behind": ("front", "behind"),
    "bigger/smaller": ("bigger_than", "smaller_than"),
    "taller/shorter": ("taller_than", "shorter_than"),
    "standing_on": ("standing_on",),
    "close_by": ("close_by",),
    "symmetrical_to": ("symmetrical_to",),
    "above": ("above",),
}
LEAST_FOR_KS = 30


@dataclass(frozen=True)
class RelationScores:
    """How many relations were measured and kept.

    Arguments:
        kept, measured: predicate name -> number of triplets.
    """

    kept: Mapping[str, int]
    measured: Mapping[str, int]

    def share(self, *predicates: str) -> float | None:
        """Kept share over the given predicates, None where none was measured."""
        measured = sum(self.measured.get(p, 0) for p in predicates)
        return sum(self.kept.get(p, 0) for p in predicates) / measured if measured else None

    def group(self, name: str) -> float | None:
        """Mean of the shares of a group's predicates (as the published table pairs left with right)."""
        shares = [share for p in GROUPS[name] if (share := self.share(p)) is not None]
        return float(np.mean(shares)) if shares else None

    def to_json(self) -> dict:
        """Shares per predicate and group, `total` over all triplets, `mean` over the groups that were measured."""
        groups = {name: share for name in GROUPS if (share := self.group(name)) is not None}
        return {
            "relations": {p: {"kept": self.share(p), "n": n} for p, n in self.measured.items() if n},
            "groups": groups,
            "total": self.share(*self.measured),
            "mean": float(np.mean(list(groups.values()))) if groups else None,
            "n": sum(self.measured.values()),
        }


def relation_scores(
    boxes: BoxesLike, triplets: Tensor, *, rules: str = "strict", subset: Tensor | None = None, **about: Any
) -> RelationScores:
    """Count the kept relations of any number of scenes.

    Arguments:
        boxes, triplets, rules, about: as for `echomodel.rules.verdicts`; boxes from any source. Without
            `fronts` `symmetrical_to` goes by places alone, as the published table does.
        subset: (E,) bool, the triplets to count; default all.
    """
    verdict = verdicts(boxes, triplets, rules=rules, **about)
    counted = verdict >= 0
    if subset is not None:
        counted &= subset
    kept, measured = {}, {}
    for predicate in vocabulary().predicates:
        chosen = counted & (triplets[:, 1] == predicate.id)
        if predicate.measures:
            measured[predicate.name] = int(chosen.sum())
            kept[predicate.name] = int((chosen & (verdict == 1)).sum())
    return RelationScores(kept, measured)


@dataclass(frozen=True)
class SizeRow:
    """Sizes of one class along one axis: number here and there, ratio of the medians, Kolmogorov-Smirnov distance."""

    category: str
    axis: str
    n: int
    real_n: int
    median_ratio: float
    ks: float | None


def size_rows(
    categories: Sequence[str], size: np.ndarray, real_categories: Sequence[str], real_size: np.ndarray
) -> list[SizeRow]:
    """Compare the distributions of sizes, class by class and axis by axis.

    Arguments:
        categories: n words. size: (n, 3) float, metres.
        real_categories, real_size: the same of the real (or true) boxes, m of them.

    Returns:
        A row per class that both have and axis; the distance where both have 30 or more.
    """
    names, real_names = np.array(categories), np.array(real_categories)
    rows = []
    for name in sorted(set(categories) & set(real_categories)):
        ours, real = size[names == name], real_size[real_names == name]
        enough = min(len(ours), len(real)) >= LEAST_FOR_KS
        for k, axis in enumerate("xyz"):
            ratio = float(np.median(ours[:, k]) / max(np.median(real[:, k]), 1e-6))
            distance = kolmogorov_smirnov(ours[:, k], real[:, k]) if enough else None
            rows.append(SizeRow(name, axis, len(ours), len(real), ratio, distance))
    return rows


def kolmogorov_smirnov(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance between the two empirical distribution functions, 0 to 1; values are rounded to 0.1 mm, so that
    sizes that passed through float32 still tie."""
    from scipy.stats import ks_2samp

    return float(ks_2samp(np.round(a, 4), np.round(b, 4), method="asymp").statistic)


def touched_triplets(triplets: Tensor, nodes: Tensor) -> Tensor:
    """(E,) bool, the triplets with an end among `nodes` (N,) bool."""
    return nodes[triplets[:, 0]] | nodes[triplets[:, 2]]
