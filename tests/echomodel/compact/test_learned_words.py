"""Weights name their words: where those stand in the vocabulary means nothing, and what they do not know is said."""

import json
import random
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import save_file

from echomodel.boxes import Boxes, BoxStatistics
from echomodel.compact.learned import places
from echomodel.compact.model import CompactModel, load_weights
from echomodel.compact.modules import WordTable
from echomodel.compact.weights import WeightsError
from echomodel.config import CompactConfig, from_dict
from echomodel.data.roomset import RoomSet, build_rooms, pack_rooms
from echomodel.echo import EchoModel
from echomodel.graph import GraphBatch
from echomodel.rooms.generator import generate_rooms
from echomodel.training.layout_stage import LayoutStage
from echomodel.training.parts_stage import PartsStage
from echomodel.training.recipe import OptimizerConfig, Recipe
from echomodel.training.run import open_run, started
from echomodel.vocabulary import speaking, vocabulary

WORDS = vocabulary()
SIZES = {"latent": {"width": 8, "layers": 1}, "furniture": {"width": 8, "layers": 1}}


def shuffled(seed=3):
    """The vocabulary with all its rows elsewhere."""
    dice = random.Random(seed)
    rows = {kind: getattr(WORDS, kind) for kind in ("categories", "predicates", "room_types")}
    return replace(WORDS, **{kind: tuple(dice.sample(of, len(of))) for kind, of in rows.items()})


def rooms_of(model, rooms):
    """Boxes and descriptions of rooms, by the words that are spoken."""
    graph = GraphBatch.pack([room.graph() for room in rooms])
    boxes = model.sample_layout(graph, generator=torch.Generator().manual_seed(1), steps=3)
    found = model.sample_furniture(graph, boxes, generator=torch.Generator().manual_seed(2), steps=3)
    return boxes.size, boxes.position, boxes.yaw, found


def test_rows_may_stand_anywhere():
    model, rooms = EchoModel.load(), generate_rooms(3, 5)
    before = rooms_of(model, rooms)
    with speaking(shuffled()):
        after = rooms_of(model, rooms)
    assert all(torch.equal(a, b) for a, b in zip(before, after, strict=True))


def test_a_new_row_changes_nothing_wherever_it_stands():
    model, rooms = EchoModel.load(), generate_rooms(2, 7)
    before = rooms_of(model, rooms)
    cooker = replace(WORDS.category("cabinet"), name="a_cooker", like="dresser", aliases=())
    kitchen = replace(WORDS.room_type("study"), name="a_kitchen", like="dining_room", aliases=())
    first = replace(WORDS, categories=(cooker, *WORDS.categories), room_types=(kitchen, *WORDS.room_types))
    with speaking(first):
        after = rooms_of(model, rooms)
        graph = GraphBatch.single([first.category_id("a_cooker")], room_type=first.room_type_id("a_kitchen"))
        assert model.unlearned(graph) == (
            "the weights do not know the category a_cooker: generated as dresser",
            "the weights do not know the room type a_kitchen: generated as dining_room",
        )
        known = GraphBatch.single([first.category_id("dresser")], room_type=first.room_type_id("dining_room"))
        assert model.unlearned(known) == ()
        layouts = [model.sample_layout(g, generator=torch.Generator().manual_seed(1), steps=2) for g in (graph, known)]
    assert all(torch.equal(a, b) for a, b in zip(before, after, strict=True))
    # what guides the last steps are rules about the room, which ask for the word itself; sizes are the network's
    assert torch.equal(layouts[0].size, layouts[1].size)


def test_likeness_is_followed_and_its_end_is_named():
    spinet = replace(WORDS.category("cabinet"), name="spinet", like="harp", aliases=())
    harp = replace(spinet, name="harp", like="bookshelf")
    with speaking(replace(WORDS, categories=(spinet, harp, *WORDS.categories))):
        found = places("categories", ("sofa", "bookshelf"), torch.tensor([0, 1]))
        assert found.tolist() == [1, 1]
        with pytest.raises(ValueError, match="these weights do not know 'spinet', nor 'harp', which its row names as"):
            places("categories", ("sofa",), torch.tensor([0]))
        harp = replace(harp, like="spinet")
    circle = replace(WORDS, categories=(spinet, harp, *WORDS.categories))
    with speaking(circle), pytest.raises(ValueError, match="do not know 'spinet', nor 'harp'"):
        WordTable("categories", ("sofa", "bookshelf"), 4)(torch.tensor([0]))


def test_a_word_that_was_renamed_keeps_its_row():
    rows = [replace(r, name="couch", aliases=("sofa",)) if r.name == "sofa" else r for r in WORDS.categories]
    likes = [replace(r, like="couch") if r.like == "sofa" else r for r in rows]
    likes = [replace(r, belongs_to=tuple("couch" if w == "sofa" else w for w in r.belongs_to)) for r in likes]
    likes = [replace(r, admits=tuple(("couch" if w == "sofa" else w, s) for w, s in r.admits)) for r in likes]
    number = WORDS.category_id("sofa")
    with speaking(replace(WORDS, categories=tuple(likes), room_types=(), habits=())):
        assert places("categories", ("chair", "sofa"), torch.tensor([number])).tolist() == [1]


@pytest.fixture
def small(tmp_path):
    """A small model's weights file, which knows the vocabulary of today."""
    torch.manual_seed(0)
    boxes = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3)
    model = CompactModel(from_dict(CompactConfig, SIZES), boxes, ("latent", "furniture"))
    model.write(tmp_path / "small.safetensors", model.parts)
    return tmp_path / "small.safetensors"


def bent(path, **config):
    with safe_open(path, "pt") as file:
        metadata, tensors = file.metadata(), {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118
    metadata["config"] = json.dumps({**json.loads(metadata["config"]), **config})
    save_file(tensors, path, metadata=metadata)
    return path


def test_files_name_their_words(small):
    with speaking(shuffled()):
        model, _ = load_weights([small])
        assert model.config.categories == tuple(row.name for row in WORDS.categories)
        assert model.config.predicates == tuple(row.name for row in WORDS.predicates if row.sgfront)


def test_words_that_do_not_fit_are_refused_by_name(small):
    names = [row.name for row in WORDS.categories]
    with pytest.raises(WeightsError, match=r"small\.safetensors: names 'armchair' twice among its categories"):
        load_weights([bent(small, categories=[*names, names[0]])])
    with pytest.raises(WeightsError, match=r"misshapen .*category\.weight"):
        load_weights([bent(small, categories=names[1:])])


def test_a_training_goes_on_in_the_words_of_its_start(small):
    recipe = Recipe("parts", 1, start=(str(small),), model=from_small())
    with speaking(shuffled()):
        assert started(PartsStage, recipe, torch.device("cpu"), resume=False).model.config.categories == tuple(
            row.name for row in WORDS.categories
        )


def test_a_warm_start_adds_the_words_that_are_new(small):
    harp = replace(WORDS.category("cabinet"), name="a_harp", like="dresser", aliases=())
    recipe = replace(Recipe("parts", 1), warm=(str(small),))
    given, _ = load_weights([small])
    with speaking(replace(WORDS, categories=(harp, *WORDS.categories))):
        recipe = replace(recipe, model=from_small())
        model = started(PartsStage, recipe, torch.device("cpu"), resume=False).model
        assert model.config.categories == (*given.config.categories, "a_harp")
        sofa = vocabulary().category_id("sofa")
        assert torch.equal(model.furniture.category(torch.tensor([sofa])), given.furniture.category.weight[[sofa - 1]])


def test_files_that_know_more_and_fewer_words_are_one_model(small, tmp_path):
    model, _ = load_weights([small])
    names = model.config.categories
    few = CompactModel(replace(model.config, categories=names[:46]), model.statistics, ("furniture",))
    few.write(tmp_path / "few.safetensors", few.parts)
    model.write(tmp_path / "latent.safetensors", ("latent",))
    both, _ = load_weights([tmp_path / "few.safetensors", tmp_path / "latent.safetensors"])
    assert both.config.categories == names
    cot, bed = WORDS.category_id("cot"), WORDS.category_id("kids_bed")
    rows = both.furniture.category(torch.tensor([cot, bed]))
    assert torch.equal(rows[0], rows[1])
    assert torch.equal(rows[1], few.furniture.category(torch.tensor([bed]))[0].half().float())
    twisted = CompactModel(replace(model.config, categories=names[1::-1]), model.statistics, ("latent",))
    twisted.write(tmp_path / "latent.safetensors", ("latent",))
    with pytest.raises(WeightsError, match=r"latent\.safetensors: categories differs from that of .*few\.safetensors"):
        load_weights([tmp_path / "few.safetensors", tmp_path / "latent.safetensors"])


@pytest.fixture
def homes(tmp_path):
    """A recipe for rooms of a home that begins with a small layout branch of 46 categories and five room types."""
    rooms = [room for name in ("bedroom", "bathroom") for room in generate_rooms(60, 5, room_type=name)]
    pack_rooms(tmp_path / "rooms.npz", rooms, [k % 10 == 0 for k in range(len(rooms))], {})
    sizes = {"latent": {"width": 8, "layers": 1}, "layout": {"width": 8, "layers": 1, "drafts": 0}}
    all_words = from_dict(CompactConfig, sizes)
    few = replace(all_words, categories=all_words.categories[:46], room_types=all_words.room_types[:5])
    classes = tuple((float(k), *[0.5] * 8) for k in range(46))
    boxes = BoxStatistics((-1.0,) * 3, (1.0,) * 3, (-1.0,) * 3, (1.0,) * 3, log_size=True, classes=classes)
    model = CompactModel(few, boxes, ("latent", "layout"))
    for numbers in model.parameters():  # heads begin with zeros, which no slope goes through
        torch.nn.init.normal_(numbers, 0.0, 0.2)
    model.write(tmp_path / "old.safetensors", model.parts)
    return Recipe(
        "layout", 2, data=str(tmp_path / "rooms.npz"), warm=(str(tmp_path / "old.safetensors"),), model=all_words,
        nodes=64, frozen=("latent",), optimizer=OptimizerConfig(rate=0.1, warmup=0, decay=0.0, average=0.0),
    )  # fmt: skip


def test_a_new_category_of_furniture_is_as_large_as_that_of_its_rooms(homes):
    start = started(LayoutStage, homes, torch.device("cpu"), resume=False)
    before = start.model.statistics
    LayoutStage.open(start)
    classes = start.model.statistics.classes
    assert classes[:46] == before.classes[:46]
    toilet, rooms = start.model.config.categories.index("toilet"), RoomSet(homes.data)
    boxes = [rooms.room(k) for k in range(len(rooms)) if not rooms.held_out[k]]
    sizes = [room.size[k] for room in boxes for k, name in enumerate(room.categories) if name == "toilet"]
    assert np.exp(classes[toilet][:3]) == pytest.approx(np.median(sizes, 0), rel=0.03)


def test_new_words_alone_are_learnt(homes, tmp_path):
    open_run(replace(homes, new_words=True), tmp_path / "run").run()
    old, new = (load_weights([tmp_path / path])[0] for path in ("old.safetensors", "run/weights.safetensors"))
    begun = started(LayoutStage, homes, torch.device("cpu"), resume=False).model
    for name, value in new.state_dict().items():
        assert torch.equal(value[: len(old.state_dict()[name])], old.state_dict()[name]), name
    toilet, harmless = (new.config.categories.index(name) for name in ("toilet", "garden_chair"))
    first, after = begun.layout.category.weight.half(), new.layout.category.weight.half()
    assert not torch.equal(after[toilet], first[toilet])
    assert torch.equal(after[harmless], first[harmless])  # in none of the rooms


def test_what_new_words_need_is_said(homes, tmp_path):
    with pytest.raises(ValueError, match="recipe field 'new_words': 'warm' names no file whose words are known"):
        open_run(replace(homes, new_words=True, warm=()), tmp_path / "run")
    with pytest.raises(ValueError, match=r"'new_words': optimizer\.decay would change known words, allowed: 0"):
        open_run(replace(homes, new_words=True, optimizer=OptimizerConfig()), tmp_path / "run")
    ships = replace(homes, model=CompactConfig(), warm=("layout.safetensors",))  # a name alone is of those that ship
    with pytest.raises(ValueError, match=r"'new_words': layout\.safetensors knows all words"):
        open_run(replace(ships, new_words=True), tmp_path / "run")
    model = started(LayoutStage, homes, torch.device("cpu"), resume=False).model
    model.write(tmp_path / "all.safetensors", model.parts)
    with pytest.raises(ValueError, match=r"'new_words': .*all\.safetensors knows all words"):
        open_run(replace(homes, new_words=True, warm=(str(tmp_path / "all.safetensors"),)), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def from_small():
    return from_dict(CompactConfig, SIZES)


def test_a_room_set_names_its_words(tmp_path):
    build_rooms(tmp_path, 4, 3, styles=5)
    before = [RoomSet(tmp_path).room(k) for k in range(4)]
    with speaking(shuffled()):
        after = RoomSet(tmp_path)
        for old, new in zip(before, (after.room(k) for k in range(4)), strict=True):
            assert (old.categories, old.room_type) == (new.categories, new.room_type)
            assert np.array_equal(old.relations, new.relations)
        graph = after.room(0).graph()
        assert [vocabulary().categories[k].name for k in graph.category.tolist()] == list(before[0].categories)
        assert vocabulary().room_types[int(graph.room_type[0])].name == before[0].room_type


def test_weights_without_a_layout_say_what_they_hold():
    weights = EchoModel.load(resources.files("echomodel") / "weights" / "parts.safetensors")
    with pytest.raises(ValueError, match="these weights hold furniture, this needs latent and layout"):
        weights.sample_layout(GraphBatch.single([0]))
    weights = EchoModel.load(resources.files("echomodel") / "weights" / "layout.safetensors")
    with pytest.raises(ValueError, match="these weights hold latent, layout, this needs latent and furniture"):
        weights.sample_furniture(GraphBatch.single([0]), Boxes(*torch.ones(2, 1, 3), torch.zeros(1)))
