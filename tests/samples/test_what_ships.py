"""What ships, as a user gets it: the weights in the package furnish the samples, at seeds that nobody chose."""

from collections import Counter
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
import torch

import echousd
from echomodel.boxes import Boxes
from echomodel.echo import EchoModel
from echomodel.furniture import solids
from echomodel.furniture.style import piece_of
from echomodel.graph import GraphBatch
from echomodel.metrics.furniture import piece_scores, sampled, style_scores
from echomodel.progress import StageTimer
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations
from echomodel.vocabulary import vocabulary
from echousd.checks.report import check
from echousd.graph.arrays import floor_centre, graph_batch
from echousd.graph.floors import with_plan
from echousd.make.layouts import finished_boxes
from echousd.make.verdicts import layout_outcome

SAMPLES = sorted((Path(__file__).parents[2] / "samples").glob("*.usda"))
SEEDS = (0, 1, 2)
ROOMS = list(zip(SAMPLES, cycle(SEEDS), strict=False))  # a seed for each sample: fifteen rooms take minutes
UNSEEN = 10_000_000  # number from which on no training set of ours has rooms
# Floors, with what was measured over all samples and seeds when they were stated:
DRAWN = 0.9  # least share of the relations that the layout network alone keeps: 197 of 213
DRAWN_COLLISIONS = 3.0  # most collisions a room that it leaves to place: 37 in 15
LIVING = 0.03  # most things a person would point at, per object of a finished room: 2 of 129
FAULTLESS = 12 / 15  # least share of rooms in which there is no such thing: 13 of 15
LOOSE = 0.02  # most pieces with a solid that touches nothing, of generated rooms: 0 of 123, 3 of 232 elsewhere
ONE_STYLE = 0.1  # most style distance within told suites, over that between suites: 0.01


def states(room) -> Counter:
    return Counter(verdict.state for verdict in room.verdicts)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A sample at a seed -> the room and what `check` says of it, made once."""
    made = {}

    def make(sample, seed):
        if (sample, seed) not in made:
            room = echousd.generate(sample, seed=seed)
            folder = tmp_path_factory.mktemp(sample.stem) / sample.stem
            made[sample, seed] = room, check(room.save(folder, preview=False))
        return made[sample, seed]

    return make


@pytest.mark.parametrize(("sample", "seed"), ROOMS, ids=[f"{path.stem} {seed}" for path, seed in ROOMS])
def test_every_relation_is_kept_and_the_check_is_clean(sample, seed, finished):
    room, report = finished(sample, seed)
    asked = len(room.graph.relations)
    assert asked >= 9
    assert states(room) == {"kept": asked}, [str(verdict) for verdict in room.verdicts if verdict.state != "kept"]
    assert report.ok, report.to_json()
    assert [layout.kept for layout in report.layouts] == [asked]
    assert report.warnings == ()
    assert room.provenance.shapes == "parts"
    assert {name for name in room.names if not room.meshes[name].is_watertight} == set()


def room_pieces(model, rooms, seed):
    """What the furniture of rooms scores, piece by piece; half of what holds in each is told."""
    rng, generator = np.random.default_rng([seed, 6]), torch.Generator().manual_seed(seed)
    words, out = [category.name for category in vocabulary().categories], []
    for room in rooms:
        relations = label_relations(room, rules="strict", drop=0.5, rng=rng)
        graph = room.graph(triplets=torch.from_numpy(relations))
        found = model.sample_furniture(graph, room.boxes(), generator=generator).float().cpu().numpy()
        for number, vector, size in zip(graph.category.tolist(), found, room.size, strict=True):
            out.append(piece_scores(solids(words[number], *piece_of(vector), np.asarray(size)), np.asarray(size))[1])
    return out


def test_furniture_holds_together_and_keeps_the_style_that_is_told():
    model = EchoModel.load()
    pieces: list = []
    for seed in SEEDS:
        pieces += room_pieces(model, generate_rooms(6, seed, start=UNSEEN), seed)
        made = partial(sampled, model, generator=torch.Generator().manual_seed(seed))
        assert style_scores(made, len(vocabulary().categories), 24, seed)["ratio"] <= ONE_STYLE
    assert len(pieces) > 100
    assert all(piece["closed"] and piece["box_error"] < 1e-6 for piece in pieces)
    assert sum(piece["loose"] for piece in pieces) / len(pieces) <= LOOSE


def test_few_things_that_a_person_would_point_at_are_left(finished):
    made = [finished(sample, seed) for sample, seed in ROOMS]
    faults = [fault.says for _, report in made for fault in report.living]
    assert len(faults) / sum(len(room.names) for room, _ in made) <= LIVING, faults
    assert sum(not report.living for _, report in made) / len(made) >= FAULTLESS, faults


def test_the_network_alone_draws_most_of_what_the_graph_says():
    """As `generate` with `place=False`, all rooms in one batch."""
    graphs = [with_plan(echousd.read_graph(sample), seed) for sample, seed in ROOMS]
    batch = GraphBatch.pack([graph_batch(graph) for graph in graphs])
    found = EchoModel.load().sample_layout(batch, generator=torch.Generator().manual_seed(0))
    total: Counter = Counter()
    hits = []
    for number, graph in enumerate(graphs):
        rows = batch.scene == number
        boxes = Boxes(found.size[rows], found.position[rows] + torch.from_numpy(floor_centre(graph)), found.yaw[rows])
        (drawn, _), _ = finished_boxes(graph, boxes, False, StageTimer())
        outcome = layout_outcome(graph, drawn)
        total += Counter(verdict.state for verdict in outcome.verdicts)
        hits += outcome.collisions
    assert total["kept"] / (total["kept"] + total["broken"]) >= DRAWN, total
    assert len(hits) / len(graphs) <= DRAWN_COLLISIONS, hits
