"""The suite: honest rows in every table, equal files for equal runs, and what it refuses."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from echomodel.metrics.layouts import tasks_of
from echomodel.roomboxes import write_rooms
from echomodel.rooms.generator import generate_rooms
from echousd.cli.main import run
from echousd.evaluation import sections, suite, systems
from echousd.evaluation.runs import Run
from echousd.evaluation.sections import things
from echousd.evaluation.suite import SuiteSettings, run_systems
from echousd.evaluation.systems import BASES, System, borrowed, finished
from echousd.graph.nodes import Node, RoomSpec
from echousd.graph.scene import SceneGraph
from echousd.make.pipeline import generate


@pytest.fixture(scope="module")
def rooms():
    return sorted(generate_rooms(32, 11), key=len)[:8]  # of little furniture


@pytest.fixture
def quick(monkeypatch):
    """Only rows that cost nothing, and little of what only makes figures finer."""
    for finer, few in {"sets.TREES": 8, "pictures.STEPS": 4}.items():
        monkeypatch.setattr(f"echomodel.metrics.{finer}", few)
    for finer, few in {"POINTS": 128, "SUITES": 4, "PAIRS": 2, "DISTANCES": {"Chamfer": 0, "EMD": 16}}.items():
        monkeypatch.setattr(f"echousd.evaluation.sections.{finer}", few)
    monkeypatch.setattr(suite, "HONEST", ("real",))
    monkeypatch.setattr(suite, "PANELS", 1)  # a plot
    monkeypatch.setattr("echousd.evaluation.sections.PUBLISHED", ("wardrobe", "nightstand"))
    monkeypatch.setattr("echousd.evaluation.sections.CONSISTENT", ("wardrobe",))
    monkeypatch.setattr("echousd.evaluation.sections.SWEPT", (2, 4))
    for few in ("SETTLED", "DRESSED"):
        monkeypatch.setattr(f"echousd.evaluation.sections.{few}", 1)


def test_every_table_holds_the_honest_rows_and_two_runs_are_equal(rooms, tmp_path, quick, capsys):
    write_rooms(tmp_path / "rooms.json", rooms)
    command = ["eval", "suite", "random", "--against", str(tmp_path / "rooms.json"), "--count", "4"]
    for name in ("one", "two"):
        assert run([*command, "--workers", "1", "-o", str(tmp_path / name)]) == 0
    assert [line.rpartition(".")[2] for line in capsys.readouterr().out.split()[:4]] == ["md", "json", "html", "json"]
    for ending in (".md", ".json", ".html"):
        assert (tmp_path / f"one{ending}").read_bytes() == (tmp_path / f"two{ending}").read_bytes()
    page = (tmp_path / "one.html").read_text("utf-8")
    assert "http://" not in re.sub("http://www.w3.org/[0-9a-z/]*", "", page)
    assert "https://" not in page
    assert "<svg" in page
    assert "data:image/png;base64," in page
    told = json.loads((tmp_path / "one.json").read_text("utf-8"))
    asked = {"random", "real"}
    assert {table["name"] for table in told["tables"]} == set(suite.SECTIONS)
    assert all(
        set(panel) >= asked
        for table in told["tables"]
        for panel in table["curves"].values()
        if table["title"] == "Sizes"
    )
    assert [line.split(" of pictures")[0] for line in told["missing"][:2]] == ["FID and KID x 1000", "FID-CLIP"]
    assert "FID" not in " ".join(column for table in told["tables"] for row in table["rows"].values() for column in row)
    assert all(set(table["rows"]) == asked for table in told["tables"] if table["name"] in ("relations", "faults"))
    assert set(told["about"]["versions"]) >= {"python", "torch", "scikit-learn"}
    first = told["tables"][0]["rows"]
    assert first["real"]["all"]["value"] == 1.0
    assert first["random"]["all"]["value"] < 0.8


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["nowhere"], "no such file, folder or system, allowed: network"),
        (["random+luck"], "finish is 'luck', allowed after +: search, half"),
        (["--only", "beauty"], "no section 'beauty', allowed: relations"),
        (["--against", "nowhere.json"], "nowhere.json: no such file or folder"),
        (["--against", "{}/empty"], "empty: no room in this folder"),
        (["--against", "{}/one.json"], "one.json: 1 rooms with a floor and two known objects, 4 are needed"),
        (["--against", "{}/bare.json"], "bare.json: 0 rooms with a floor and two known objects"),
        (
            ["--against", "{}/garages.json"],
            "garages.json: unknown room type 'garage' (not supported): allowed: bedroom",
        ),
        (["{}/empty"], "empty: no room in this folder, allowed: rooms of ours, USD, rooms or scene JSON"),
        (["{}/one.json"], "one.json: 1 rooms with known objects, 2 or more are needed"),
        (["{}/garages.json"], "garages.json: unknown room type 'garage'"),
        (["{}/zorgs.json"], "zorgs.json: 0 rooms with known objects, 2 or more are needed"),
        (
            ["--inception", "{}/gone.pt"],
            "gone.pt: no such file, --inception wants inception-2015-12-05.pt, as clean-fid",
        ),
        (["--inception", "{}/bad.pt"], "bad.pt: not the weights that --inception wants"),
        (["--clip", "{}/gone.pt"], "gone.pt: no such file, --clip wants OpenAI's ViT-B-32.pt"),
    ],
)
def test_what_there_is_not_is_named(arguments, text, rooms, tmp_path, capsys):
    raw = [room.to_json() for room in rooms]
    zorgs = [one | {"objects": [o | {"category": "zorg"} for o in one["objects"]]} for one in raw]
    files = {"one": raw[:1], "bare": [one | {"floor_polygon": []} for one in raw], "zorgs": zorgs,
             "garages": [one | {"room_type": "garage"} for one in raw]}  # fmt: skip
    for name, held in files.items():
        (tmp_path / f"{name}.json").write_text(json.dumps({"convention": "", "rooms": held}))
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad.pt").write_text("no weights")
    assert run(["eval", "suite", *(word.format(tmp_path) for word in arguments), "-o", str(tmp_path / "r")]) == 2
    assert text in " ".join(capsys.readouterr().err.split())


def test_systems_keep_furniture_and_floor_and_draw_from_their_seed(rooms):
    tasks = tasks_of(rooms, 0, stated=1.0)
    for name in ("random", "generator", "retrieval", "shuffled", "muted", "real"):
        one, again = (BASES[name][0](tasks, 3) for _ in range(2))
        for task, room, same in zip(tasks, one, again, strict=True):
            assert room.categories == task.room.categories
            assert np.array_equal(room.floor_polygon, task.room.floor_polygon)
            assert np.isfinite(room.position).all()
            assert np.array_equal(room.position, same.position)


def test_a_retrieved_room_is_itself(rooms):
    room = rooms[0]
    found = borrowed(room, room, np.random.default_rng(0))
    order = np.lexsort(room.position.T)
    assert np.allclose(found.position[np.lexsort(found.position.T)], room.position[order], atol=1e-9)


def test_half_chooses_by_one_half_of_the_terms_alone(rooms, monkeypatch):
    task = tasks_of(rooms[:1], 0, stated=1.0)[0]
    drafts = [rooms[0], replace(rooms[0], id="better")]
    scores = {"room": (5.0, 0.0), "better": (1.0, 9.0)}
    seen = []

    def scored(task, room):
        a, b = scores["better" if room.id == "better" else "room"]
        return {"told": (1.0, 1.0), "physics": (0.0, 1.0), "faults A": (a, 1.0), "faults B": (b, 1.0)}

    monkeypatch.setattr(systems, "layout_scores", scored)
    monkeypatch.setattr(systems, "searched", lambda task, draft, config: seen.append(config.without) or draft)
    assert finished(System.parse("random+half"), task, drafts).id == "better"
    assert seen == [systems.HALVES[1]] * 2


def test_repetition_is_the_share_of_other_rooms_that_hold_the_same(rooms, monkeypatch):
    held = [{("cup", "a"), ("rug", "b")}, {("cup", "a")}, {("cup", "a"), ("rug", "c")}]
    monkeypatch.setattr(sections, "_generated", lambda room, seed, dress: SimpleNamespace(stage=seed))
    monkeypatch.setattr(sections, "things", lambda stage: held[stage])
    run = Run(SuiteSettings(), [System.parse("random")], [], [], {"random": rooms[:3]}, {}, {})
    row = sections.repetition(run)[0].rows["random"]
    assert row["met again"].value == pytest.approx(3 / 5)  # of five things the cup, in all other rooms
    assert row["different things"].value == 3
    assert row["rooms with the most frequent"].value == 3


def test_small_things_are_told_apart_by_prints_and_shapes_not_by_colours():
    chair = SceneGraph(room=RoomSpec(type="bedroom", size=(4.0, 3.5)), nodes=(Node("bed", "double_bed"),))
    one, again, other = (things(generate(chair, seed=seed, palette=palette).stage) for seed, palette in
                         ((3, "oak"), (3, "ink"), (4, "oak")))  # fmt: skip
    assert one == again
    assert {word for word, *_ in one} & {word for word, *_ in other}
    assert len(one & other) < len(one) / 2


def test_workers_change_nothing(rooms):
    tasks = tasks_of(rooms[:2], 0, stated=1.0)
    asked = [System.parse("random+search")]
    alone, together = (run_systems(asked, tasks, SuiteSettings(workers=count))[0]["random+search"] for count in (1, 2))
    assert all(np.array_equal(a.position, b.position) for a, b in zip(alone, together, strict=True))
