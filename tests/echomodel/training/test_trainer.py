"""Recipes, batches, every stage end to end on tiny data, and runs that resume bit for bit."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import torch

from echomodel.boxes import Boxes
from echomodel.compact.model import WeightsError, load_weights
from echomodel.compact.pairs import pairs_of
from echomodel.data.roomset import RoomSet
from echomodel.echo import EchoModel
from echomodel.floors import known
from echomodel.graph import GraphBatch
from echomodel.rooms.generator import generate_rooms
from echomodel.rules import label_relations, verdicts
from echomodel.training import trainer
from echomodel.training.layout_losses import as_carried, measure_distance, outside, stated_triplets
from echomodel.training.layout_stage import LayoutStage
from echomodel.training.recipe import OptimizerConfig, Recipe, read_recipe
from echomodel.training.rooms import PackedRooms, draw_batch, make_batch
from echomodel.training.run import open_run
from echomodel.training.shape_stage import AutoencoderStage
from echomodel.training.trainer import read_log, step_generator
from echomodel.vocabulary import vocabulary

RECIPES = Path(__file__).parents[3] / "model" / "recipes"


def smoke(stage: str, data: Path, *settings: str) -> Recipe:
    return read_recipe(RECIPES / "smoke.toml", [f"stage={stage}", f"data={data}", *settings])


def test_told_relations_hold_in_mirrored_rooms(packed: PackedRooms) -> None:
    seen = 0
    for seed in range(2):
        batch = draw_batch(packed, 100, torch.Generator().manual_seed(seed))
        triplets = stated_triplets(batch)
        for number, rules in enumerate(("sgfront", "strict")):
            mine = triplets[batch.rules[batch.graph.scene[triplets[:, 0]]] == number]
            kept = verdicts(batch.boxes, mine, rules=rules)
            seen += int((kept >= 0).sum())
            assert not (kept == 0).any()
    assert seen > 250


def test_losses_see_boxes_at_the_heights_of_what_carries_them(packed: PackedRooms) -> None:
    batch = draw_batch(packed, 120, torch.Generator().manual_seed(1))
    lifted = batch.boxes.position + torch.tensor([0.1, 0.4, 0.1])
    seen = as_carried(batch, Boxes(batch.boxes.size, lifted, batch.boxes.yaw))
    hangs = torch.tensor([vocabulary().categories[number].support == "wall" for number in batch.graph.category])
    torch.testing.assert_close(seen.position[:, 1], torch.where(hangs[:, None], lifted, batch.boxes.position)[:, 1])
    torch.testing.assert_close(seen.position[:, [0, 2]], lifted[:, [0, 2]])


def test_floors_are_mirrored_with_their_rooms() -> None:
    tidy = [room for room in generate_rooms(40, seed=5) if len(room.floor_polygon) > 4]
    packed = PackedRooms.build([replace(room, relations=label_relations(room)) for room in tidy], 0)
    seen = 0
    for seed in range(3):
        batch = draw_batch(packed, 200, torch.Generator().manual_seed(seed))
        told = known(batch.graph.floor)
        assert float(outside(batch.boxes, batch.graph.floor[batch.graph.scene]).max()) < 0.06
        seen += int((~told).any()) + int(told.any())
    assert seen == 6  # some floors are hidden, some are not


def test_measures_of_true_boxes_are_met_and_pull_at_places_alone(packed: PackedRooms) -> None:
    batch = draw_batch(packed, 120, torch.Generator().manual_seed(1))
    floor, nodes = batch.graph.floor[batch.graph.scene], batch.graph.num_nodes
    level, free = torch.full((nodes,), 0.2), torch.ones(nodes)
    free[::3] = 0.0
    assert measure_distance(batch, batch.boxes, floor, level, free) == 0
    size = batch.boxes.size.clone().requires_grad_()
    position = (batch.boxes.position + 0.1 * free[:, None]).requires_grad_()
    distance = measure_distance(batch, Boxes(size, position, batch.boxes.yaw), floor, level, free)
    distance.backward()
    assert distance > 0.01
    assert size.grad is None
    assert position.grad is not None
    assert torch.isfinite(position.grad).all()
    assert (position.grad.abs().sum(1) > 0).float().mean() > 0.9


def test_a_recipe_may_compile_what_is_measured(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []

    def compiled(function, *, dynamic):
        def run(boxes, *rest):
            seen.append(len(boxes))
            return function(boxes, *rest)

        return run if dynamic else function

    monkeypatch.setattr(torch, "compile", compiled)
    settings = "model.layout.layers=2", "model.layout.drafts=1", "nodes=40", "measure_weight=1.0"
    for on, times in (("false", 0), ("true", 3)):  # one draft, the prediction and the true boxes
        trainer = open_run(smoke("layout", data, *settings, f"compiled={on}"), tmp_path / on)
        trainer.stage.loss(trainer.model, torch.Generator().manual_seed(0))
        assert len(seen) == times


def test_batches_keep_the_node_budget_and_merge_like_graphs(packed: PackedRooms) -> None:
    batch = draw_batch(packed, 100, torch.Generator().manual_seed(0))
    assert 80 < batch.graph.num_nodes <= 100
    triplets = stated_triplets(batch)
    assert torch.equal(pairs_of(batch.graph.with_triplets(triplets)).stated, batch.pairs.stated)


def test_densities_range_from_hand_written_to_dense(packed: PackedRooms) -> None:
    per_object = []
    for seed in range(30):
        batch = draw_batch(packed, 60, torch.Generator().manual_seed(seed))
        owner = batch.graph.scene[batch.pairs.receiver]
        told = torch.zeros(batch.graph.num_scenes).index_add_(0, owner, batch.predicates.sum(1).float())
        per_object.append(told / batch.graph.node_counts)
    shares = torch.cat(per_object)
    assert (shares < 3).float().mean() > 0.2
    assert (shares > 8).float().mean() > 0.2


def test_pseudo_edits_leave_out_added_nodes(packed: PackedRooms) -> None:
    batch = make_batch(packed, torch.arange(40), torch.Generator().manual_seed(1))
    assert 5 < int(batch.added.sum()) < 25
    assert not batch.added[batch.before.receiver].any()
    assert not batch.added[batch.before.sender].any()
    assert bool((batch.touched | ~batch.added).all())


def test_smoke_recipe_trains_everything(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Autoencoder, layout and shapes; losses fall and a room with shapes can be sampled."""
    monkeypatch.setattr("echomodel.compact.sampling.AFTER", 1)  # of forty equal steps
    drawn = trainer.plot_log
    whole = AutoencoderStage.validate
    monkeypatch.setattr(AutoencoderStage, "validate", lambda stage, model: whole(stage, model, 4))  # held-out shapes
    few = "shapes_per_batch=3", "model.autoencoder.width=8"
    weights = {name: str(tmp_path / name / "weights.safetensors") for name in ("vqvae", "layout", "shape")}
    starts = {
        "vqvae": [],
        "layout": [],
        "shape": [weights["layout"], weights["vqvae"]],
    }
    for stage, start in starts.items():
        names = ",".join(f'"{path}"' for path in start)
        count = {"vqvae": 24}.get(stage, 40)
        steps = f"steps={count}", f"validate_every={count}"
        monkeypatch.setattr(trainer, "plot_log", drawn if stage == "layout" else lambda log, out: None)
        open_run(smoke(stage, data, f"start=[{names}]", *few, *steps), tmp_path / stage).run()
        losses = [value for _, name, value in read_log(tmp_path / stage / "log.csv") if name == "loss"]
        assert np.median(losses[-4:]) < 0.97 * losses[0], stage
    assert (tmp_path / "layout/curves.png").stat().st_size > 5000
    names = ",".join(f'"{weights[stage]}"' for stage in ("vqvae", "shape"))  # the decoder, on what the denoiser can say
    recipe = smoke("vqvae", data, f"start=[{names}]", *few, "steps=6", "validate_every=6")
    decoder = open_run(recipe, tmp_path / "decoder")
    basis = decoder.model.autoencoder.basis.clone()
    decoder.run()
    logged = {name: value for _, name, value in read_log(tmp_path / "decoder" / "log.csv")}
    assert 0 < logged["held/fscore_projected"] <= 1
    assert logged["loss"] == pytest.approx(logged["reconstruction"] + logged["projected"], rel=1e-3)
    assert torch.equal(decoder.model.autoencoder.basis, basis)
    model = EchoModel(*load_weights([Path(weights[stage]) for stage in weights]))
    graph = GraphBatch.single([14, 23], [[1, 5, 0]], floor=(4.0, 3.0))
    boxes = model.sample_layout(graph, generator=torch.Generator().manual_seed(0), steps=3)
    grids = model.sample_shapes(graph, boxes, generator=torch.Generator().manual_seed(0), steps=2)
    assert grids.shape == (2, 64, 64, 64)
    assert torch.isfinite(grids).all()


@pytest.fixture
def steps_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs neither look at held-out rooms nor draw their curves."""
    for one in (AutoencoderStage, LayoutStage):
        monkeypatch.setattr(one, "validate", lambda stage, model: {})
    monkeypatch.setattr(trainer, "plot_log", lambda log, out: None)


@pytest.mark.parametrize("stage", ["layout", "vqvae"])
def test_resumed_run_is_bit_equal(stage: str, data: Path, tmp_path: Path, steps_alone: None) -> None:
    recipe = smoke(stage, data, "steps=6", "log_every=1", "shapes_per_batch=2", "nodes=80")
    whole = open_run(recipe, tmp_path / "whole")
    whole.run()
    open_run(recipe, tmp_path / "parts").run(until=2)
    middle = open_run(recipe, tmp_path / "parts", resume=True)
    middle.run(until=4)
    last = open_run(recipe, tmp_path / "parts", resume=True)
    assert last.step == 4
    last.run()
    for one, other in ((whole.model, last.model), (whole.average, last.average)):
        for (name, a), b in zip(one.state_dict().items(), other.state_dict().values(), strict=True):
            assert torch.equal(a, b), name
    rows = [[row for row in read_log(tmp_path / run / "log.csv") if row[1] == "loss"] for run in ("whole", "parts")]
    assert rows[0] == rows[1]
    assert [step for step, _, _ in rows[0]] == [1, 2, 3, 4, 5, 6]


def test_shape_stage_needs_its_start(data: Path, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="stage 'shape' needs weights with latent and autoencoder"):
        open_run(smoke("shape", data), tmp_path)


def test_weights_files_are_checked(data: Path, tmp_path: Path) -> None:
    open_run(smoke("layout", data, "steps=1"), tmp_path).run()
    path = tmp_path / "weights.safetensors"
    content = path.read_bytes()
    (tmp_path / "cut.safetensors").write_bytes(content[: len(content) // 2])
    with pytest.raises(WeightsError, match=r"cut.safetensors: not a readable safetensors file"):
        load_weights([tmp_path / "cut.safetensors"])
    with pytest.raises(WeightsError, match="no weights files found"):
        load_weights([])
    from safetensors.torch import save_file

    save_file({"a": torch.zeros(1)}, tmp_path / "other.safetensors")
    with pytest.raises(WeightsError, match="format is None, expected 'echousd-compact-1'"):
        load_weights([tmp_path / "other.safetensors"])
    from safetensors import safe_open

    with safe_open(path, "pt") as handle:
        tensors = {key: handle.get_tensor(key) for key in handle.keys()}  # noqa: SIM118
        metadata = handle.metadata()
    tensors["layout.heads.0.weight"] = tensors["layout.heads.0.weight"][:, :3].contiguous()
    del tensors["latent.mix.bias"]
    save_file(tensors, tmp_path / "bad.safetensors", metadata=metadata)
    text = r"1 missing \(latent.mix.bias\); 1 misshapen \(layout.heads.0.weight\)"
    with pytest.raises(WeightsError, match=text):
        load_weights([tmp_path / "bad.safetensors"])


def test_recipes_name_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no such recipe"):
        read_recipe(tmp_path / "none.toml")
    (tmp_path / "a.toml").write_text('stage = "layout"\n')
    with pytest.raises(ValueError, match=r"a.toml: field 'steps' is missing"):
        read_recipe(tmp_path / "a.toml")
    (tmp_path / "b.toml").write_text('stage = "layout"\nsteps = 5\n[optimizer]\nspeed = 3\n')
    with pytest.raises(ValueError, match=r"unknown field 'optimizer.speed', allowed: rate"):
        read_recipe(tmp_path / "b.toml")
    with pytest.raises(ValueError, match="stage is 'layouts', allowed: vqvae, layout, shape, parts, paper_vqvae"):
        read_recipe(RECIPES / "layout.toml", ["stage=layouts"])
    with pytest.raises(ValueError, match="setting 'steps' has no '='"):
        read_recipe(RECIPES / "layout.toml", ["steps"])


def test_a_recipe_begins_with_weights_that_ship_wherever_it_is_run(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    ships = Path(resources.files("echomodel") / "weights" / "layout.safetensors")
    for name in ("tune", "layout_fine"):
        assert read_recipe(RECIPES / f"{name}.toml").warm_files == (ships,)
    (tmp_path / "layout.safetensors").write_bytes(b"")
    assert read_recipe(RECIPES / "tune.toml").warm_files == (Path("layout.safetensors"),)
    assert read_recipe(RECIPES / "tune.toml", ['warm=["a/layout.safetensors"]']).warm_files[0].parts[0] == "a"


@pytest.mark.parametrize("path", sorted(RECIPES.glob("*.toml")), ids=lambda path: path.stem)
def test_committed_recipes_are_valid(path: Path) -> None:
    assert read_recipe(path).steps > 0


def test_schedules() -> None:
    paper = OptimizerConfig(rate=1e-4, schedule="paper")
    rates = [paper.rate_at(step, 200_000) for step in (0, 35_000, 70_000, 140_000)]
    assert rates == pytest.approx([1e-4, 5e-5, 1e-5, 5e-6])
    cosine = OptimizerConfig(rate=1.0, schedule="cosine", warmup=10)
    assert cosine.rate_at(0, 100) == pytest.approx(0.1)
    assert cosine.rate_at(50, 100) == pytest.approx(0.5)
    trapezoid = OptimizerConfig(rate=1.0, schedule="trapezoid", warmup=10, cooldown=20)
    assert [trapezoid.rate_at(step, 100) for step in (50, 90)] == pytest.approx([1.0, 0.5])


def test_steps_and_seeds_draw_differently() -> None:
    keys = ((0, 1), (0, 2), (1, 1))
    draws = [float(torch.rand(1, generator=step_generator(*key))) for key in keys]
    assert len(set(draws)) == 3
    assert draws[0] == float(torch.rand(1, generator=step_generator(0, 1)))


def test_boxes_of_a_room_set_survive_packing(data: Path, packed: PackedRooms) -> None:
    rooms = RoomSet(data / "rooms")
    first = int((~rooms.held_out).nonzero()[0][0])
    boxes = rooms.room(first).boxes()
    torch.testing.assert_close(packed.position[: len(boxes)], boxes.position)


def test_a_checkpoint_of_another_recipe_is_refused_and_the_fields_are_named(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LayoutStage, "validate", lambda stage, model: {})
    recipe = smoke("layout", data, "steps=1", "validate_every=9")
    open_run(recipe, tmp_path).run()
    open_run(replace(recipe, steps=2, nodes=300, threads=1), tmp_path, resume=True)  # these may change
    width = recipe.model.layout.width
    other = replace(recipe, seed=8, model=replace(recipe.model, layout=replace(recipe.model.layout, width=2 * width)))
    told = rf"another recipe \(model.layout.width was {width}, is {2 * width}; seed was {recipe.seed}, is 8\)"
    with pytest.raises(ValueError, match=told):
        open_run(other, tmp_path, resume=True)
    assert EchoModel.load(tmp_path).branches == {"layout"}  # the folder of the run serves as weights
    path = tmp_path / "checkpoint.safetensors"
    whole = path.read_bytes()
    renamed = whole.replace(b'"average.', b'"averaga.', 1)
    for damaged, said in ((whole[:-9], "not a checkpoint of a training"), (renamed, "does not fit the recipe's model")):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match=rf"checkpoint.safetensors: {said}"):
            open_run(recipe, tmp_path, resume=True)
    path.write_bytes(whole)
    for content in (b"step,name,value\n1,l\xffss,0.5\n", b"step,name\n1,loss\n", b"a,b\n1,2\n"):
        (tmp_path / "log.csv").write_bytes(content)
        with pytest.raises(ValueError, match=r"log.csv: not the log of a training"):
            read_log(tmp_path / "log.csv")


def test_a_log_holds_means_of_the_steps_since_a_run_went_on(data: Path, tmp_path: Path, steps_alone: None) -> None:
    recipe = smoke("layout", data, "steps=6", "log_every=6", "validate_every=100", "save_every=100")
    once, twice = (open_run(recipe, tmp_path / name) for name in ("once", "twice"))
    once.run()
    twice.run(until=5)
    twice.run()
    loss = [next(value for _, name, value in read_log(tmp_path / of / "log.csv") if name == "loss")
            for of in ("once", "twice")]  # fmt: skip
    assert loss[1] > 0.5 * loss[0]  # of one step, and not a sixth of it


LAYOUTS_ALONE = """
import sys
from importlib.abc import MetaPathFinder

class Bare(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"zstandard", "trimesh", "manifold3d", "pxr", "pydantic", "shapely", "skimage"}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Bare())
import echomodel.training.run
assert echomodel.training.run.STAGES["layout"].itself.__name__ == "LayoutStage"
"""


def test_layouts_are_trained_without_the_libraries_of_shapes() -> None:
    subprocess.run([sys.executable, "-c", LAYOUTS_ALONE], check=True)
