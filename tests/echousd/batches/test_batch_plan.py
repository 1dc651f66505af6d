"""Plans: equal for equal requests, different in words for others; graphs from every kind of source."""

import itertools
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from echomodel.vocabulary import vocabulary
from echousd.batches import plan as plans
from echousd.batches.options import parse_sample, read_toml, request_of
from echousd.batches.sources import find_graphs, sampled_graph
from echousd.batches.verify import verify

SAMPLES = Path(__file__).parents[3] / "samples"


def plan_of(**raw):
    return plans.make_plan(request_of(raw, "test"), "abc")


def test_a_plan_is_the_same_every_time_and_comes_back_from_the_disk(tmp_path):
    raw = {"sources": [str(SAMPLES / "*.yaml")], "count": 2, "sample": {"bedroom": 3}}
    plan = plan_of(**raw)
    assert len(plan.entries) == 2 * len(list(SAMPLES.glob("*.yaml"))) + 3
    assert len({entry.id for entry in plan.entries}) == len(plan.entries)
    assert plan.entries[1].seed == 1
    plans.save_plan(plan, tmp_path)
    assert plans.difference(plans.load_plan(tmp_path), plan_of(**raw)) == ""


def test_shards_share_the_plan_out():
    plan = plan_of(sample={"bedroom": 50})
    parts = [[entry.id for entry in plan.part((i, 3))] for i in range(3)]
    assert sorted(map(len, parts)) == [16, 17, 17]
    assert sorted(itertools.chain(*parts)) == sorted(entry.id for entry in plan.entries)


def test_a_difference_is_told():
    old, new = plan_of(sample={"bedroom": 2}), plan_of(sample={"bedroom": 2}, options={"walls": False})
    assert plans.difference(old, new) == "options.walls was true, now false"
    assert "seed was 0, now 3" in plans.difference(old, plan_of(sample={"bedroom": 2}, seed=3))
    changed = replace(old, entries=(replace(old.entries[0], graph="beef"), *old.entries[1:]))
    assert plans.difference(old, changed) == "1 graphs changed, the first of sample:bedroom:0"


def test_a_graph_that_is_written_otherwise_is_the_same_graph():
    new = plan_of(sources=[str(SAMPLES / "bedroom.yaml")])
    text, *_ = new.graphs.values()
    entries = tuple(replace(entry, graph="beef") for entry in new.entries)
    old = replace(new, entries=entries, graphs={"beef": json.dumps(json.loads(text), indent=4)})
    assert old.digest != new.digest
    assert plans.difference(old, new) == ""
    other = replace(old, graphs={"beef": text.replace("wardrobe", "desk")})
    assert plans.difference(other, new).startswith("1 graphs changed, the first of ")


def test_variations_are_taken_in_turn():
    plan = plan_of(sample={"bedroom": 4}, variations={"walls": [True, False], "ceiling": [True, False]})
    chosen = [plan.options[entry.options] for entry in plan.entries]
    assert [(o.walls, o.ceiling) for o in chosen] == [(True, True), (True, False), (False, True), (False, False)]


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        ({}, "neither sources nor a sample"),
        ({"sample": {"bedroom": 0}}, "sample.bedroom is 0"),
        ({"sample": {"bedroom": 1}, "options": {"colour": 1}}, "colour is no option, allowed: assets, atlas"),
        ({"sample": {"bedroom": 1}, "variations": {"walls": []}}, "an empty list"),
        ({"sample": {"bedroom": 1}, "variations": {"wall": [True]}}, "wall is no option"),
    ],
)
def test_a_wrong_request_is_told(raw, said):
    with pytest.raises(ValueError, match=said):
        request_of(raw, "batch.toml")


def test_toml_holds_a_request(tmp_path):
    path = tmp_path / "batch.toml"
    path.write_text('sources = ["graphs"]\ncount = 2\n[sample]\nbedroom = 4\n[options]\nshapes = "boxes"\n')
    request = request_of(read_toml(path), str(path))
    assert (request.sources, request.count, request.options.shapes) == ([str(tmp_path / "graphs")], 2, "boxes")
    path.write_text("count = ")
    with pytest.raises(ValueError, match="cannot be read as TOML"):
        read_toml(path)


def test_samples_are_parsed():
    assert parse_sample("bedroom:5,living_room:3") == {"bedroom": 5, "living_room": 3}
    with pytest.raises(ValueError, match="--sample is 'bedroom', allowed: a room type and a count"):
        parse_sample("bedroom")


def test_a_poisonous_graph_is_told_and_the_others_are_read(tmp_path):
    good = json.loads(next(find_graphs([str(SAMPLES / "bedroom.yaml")])).text)
    path = tmp_path / "many.jsonl"
    path.write_text("\n".join([json.dumps(good), '{"room":', json.dumps({"graph": good}), ""]))
    first, second, third = find_graphs([str(path)])
    assert first.text == third.text != ""
    assert second.text == ""
    assert f"{path}:2" in second.error
    with pytest.raises(ValueError, match=r"no graphs there; allowed: \.yaml"):
        list(find_graphs([str(tmp_path / "*.usda")]))


def test_a_sampled_graph_is_a_function_of_its_numbers():
    one = sampled_graph("bedroom", 3, 7, 1.5)
    assert one == sampled_graph("bedroom", 3, 7, 1.5) != sampled_graph("bedroom", 3, 8, 1.5)
    assert one.relations
    assert one.room.floor_polygon
    assert all(node.position is None for node in one.nodes)
    with pytest.raises(ValueError, match="allowed: bedroom"):
        sampled_graph("cellar", 0, 0, 1)


@pytest.mark.parametrize("kind", [row.name for row in vocabulary().room_types])
def test_rooms_of_every_type_are_sampled(kind):
    assert sampled_graph(kind, 3, 0, 1.0).room.type == kind


def test_a_torn_line_is_no_room(tmp_path):
    place = plans.shard_folder(tmp_path, (0, 1))
    journal = plans.Journal(place)
    done = {"room": "a", "when": 1, "state": "done", "root": "a.usda", "bounds": [0.0] * 6, "sha256": "12"}
    journal.append(done)
    journal.close()
    with (place / "journal.jsonl").open("a") as file:
        file.write('{"room": "b", "wh')
    journal = plans.Journal(place)
    journal.append({"room": "c", "when": 2, "state": "failed", "error": "no floor"})
    hostile = {"root": "../../secret.usda"}, {"bounds": [0.0, float("nan"), 0, 0, 0, 0]}, {"sha256": 7}, {"faces": "x"}
    for wrong in (*hostile, {"when": []}, {"state": 3}, {"categories": {"bed": []}}):
        journal.append({**done, "when": 3, **wrong})
    journal.close()
    assert {name: row["state"] for name, row in plans.read_journals(tmp_path).items()} == {"a": "done", "c": "failed"}


def test_a_room_s_digest_is_of_its_files(tmp_path):
    room = tmp_path / "room"
    (room / "layers").mkdir(parents=True)
    (room / "layers" / "a.usda").write_text("a")
    before = plans.room_digest(room)
    (room / ".echousd.lock").write_text("x")
    assert plans.room_digest(room) == before
    (room / "layers" / "a.usda").write_text("b")
    assert plans.room_digest(room) != before
    assert plans.room_digest(tmp_path / "none") == ""


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"id": "../../../outside"}, "line 2: id is '../../../outside', allowed: a name of letters, digits and _"),
        ({"number": -1}, "line 2: number is -1, allowed: greater than or equal to 0"),
        ({"number": "0"}, "line 2: number is '0', allowed: a valid integer"),
        ({"options": 9}, "line 2: options is 9, allowed: 0 to 0"),
    ],
)
def test_a_plan_is_read_with_doubt(tmp_path, change, text):
    plans.save_plan(plan_of(sample={"bedroom": 1}), tmp_path)
    path = tmp_path / ".batch/plan.jsonl"
    head, line = path.read_text().splitlines()
    path.write_text(f"{head}\n{json.dumps({**json.loads(line), **change})}\n")
    with pytest.raises(ValueError, match=re.escape(text)):
        plans.load_plan(tmp_path)


def test_no_link_leads_out_of_a_run(tmp_path):
    run, outside = tmp_path / "run", tmp_path / "outside"
    plans.save_plan(plan_of(sample={"bedroom": 1}), run)
    outside.mkdir()
    (run / "rooms").mkdir()
    (run / "rooms/0000").symlink_to(outside)
    with pytest.raises(ValueError, match=r"rooms/0000 is a link to .*outside, outside of"):
        list(verify(run))
    (run / ".batch").rename(outside / "batch")
    (run / ".batch").symlink_to(outside / "batch")
    with pytest.raises(ValueError, match=r"is a link to .*outside/batch, outside of"):
        plans.load_plan(run)
