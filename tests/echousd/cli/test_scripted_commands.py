"""What scripts ask of commands: --json, --quiet, and pictures named after cameras."""

from __future__ import annotations

import json
import warnings

import pytest
from PIL import Image
from pxr import Usd, UsdGeom
from small_room import StandIn, small_graph

import echousd
from echousd.cli import main, output
from echousd.cli.terminal import Terminal

BOXES = ("--shapes", "boxes", "--drafts", 1)


@pytest.fixture(autouse=True)
def model(monkeypatch):
    from echomodel.echo import EchoModel

    monkeypatch.setattr(EchoModel, "load", classmethod(lambda cls, path=None, **options: StandIn(0.3)))


@pytest.fixture
def graph(tmp_path):
    path = tmp_path / "graph.usda"
    echousd.write_graph(small_graph(), path)
    return path


def read(text):
    """Strict JSON: no NaN."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def test_json_of_a_room_from_generation_to_export(graph, tmp_path, echousd_command):
    root = tmp_path / "bedroom/bedroom.usda"
    done = echousd_command("generate", graph, "-o", root.parent, *BOXES, "--json")
    made = read(done.out)
    assert made["written"] == [str(root), str(root.with_suffix(".png"))]
    assert made["ok"] == (done.code == 0) == (not made["faults"])
    (room,) = made["rooms"]
    assert (room["room"], room["objects"]) == (str(root), 6)
    assert sum(room["layouts"][0]["relations"].values()) == len(small_graph().relations)
    assert set(made["timings"]) >= {"imports", "read", "load", "layout", "meshes", "write", "preview"}
    assert 0 < made["timings"]["write"] < made["timings"]["total"] <= made["seconds"] + 0.01

    wish = ("edit", root, "--restyle", "bed:oak", *BOXES, "--json")
    plan = read(echousd_command(*wish, "--dry-run").out)
    assert (plan["written"], plan["new"], plan["changes"]) == ([], [], ["~ object bed: style none -> oak"])
    edited = read(echousd_command(*wish).out)
    assert edited["changes"] == plan["changes"]
    assert edited["written"][0] == str(root)
    undone = read(echousd_command("edit", root, "--undo", "--json").out)
    assert undone["undone"]
    assert str(root) in undone["written"]

    for words in (
        ("render", root, "-o", tmp_path / "a.png", "--size", 16),
        ("export", root, "-o", tmp_path / "a.usdc"),
    ):
        told = read(echousd_command(*words, "--json").out)
        assert (told["ok"], told["written"], told["faults"]) == (True, [str(words[3])], [])
        assert told["seconds"] > 0


def test_json_of_faults_ends_with_code_1(tmp_path, echousd_command):
    graph = tmp_path / "graph.usda"
    small = small_graph()
    for name in ("bed", "wardrobe"):  # in one another, where somebody put them
        small = small.update_node(name, position=(0.0, 0.0, 0.0), locked=True)
    echousd.write_graph(small.replaced(relations=()), graph)
    done = echousd_command("generate", graph, "-o", tmp_path / "room", *BOXES, "--json", "--quiet")
    told = read(done.out)
    assert done.code == 1
    assert not told["ok"]
    assert told["faults"]
    done = echousd_command("generate", graph, "-o", tmp_path / "room", *BOXES, "--quiet")
    assert (done.code, done.out, done.err) == (1, "", "")


def test_help_says_that_commands_can_be_quiet(echousd_command):
    assert "--quiet" in echousd_command("--help").out


def test_quiet_keeps_errors_warnings_and_what_was_asked_for(graph, echousd_command, monkeypatch):
    done = echousd_command("graph", graph, "--quiet")
    assert (done.code, done.err) == (0, "")
    assert done.out == echousd_command("graph", graph).out
    assert read(echousd_command("graph", graph, "--quiet", "--json").out)["nodes"]
    done = echousd_command("graph", "gone.yaml", "--quiet")
    assert (done.code, done.out, done.err) == (2, "", "error: gone.yaml: no such file or directory\n")

    def noisy(source):
        output.say("progress")
        Terminal(stderr=True).print("more of it")
        warnings.warn("look out", UserWarning, stacklevel=1)
        output.say_error("a room failed")

    monkeypatch.setattr("echousd.home.files.load_home", noisy)
    with pytest.warns(UserWarning, match="look out"):
        done = echousd_command("--quiet", "plan", "export", graph, "-o", "plan.png")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("a room failed\nerror: ")
    assert done.err.count("\n") == 2


def test_a_picture_for_each_camera(tmp_path, echousd_command):
    path = tmp_path / "stage.usda"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.Cube.Define(stage, "/Cube")
    for where, far in (("/door", 5.0), ("/a/window", 8.0), ("/b/window", 90.0)):
        UsdGeom.Camera.Define(stage, where).AddTranslateOp().Set((0, 0, far))
    stage.Save()
    words = ("render", path, "--size", 16, "--cameras", "-o")
    done = echousd_command(*words, tmp_path / "shots")
    assert done.code == 0, done.err
    names = ["door.png", "window.png", "window_2.png"]
    assert done.out.splitlines() == [str(tmp_path / "shots" / name) for name in names]
    pictures = [Image.open(tmp_path / "shots" / name) for name in names]
    assert [picture.size for picture in pictures] == [(16, 12)] * 3  # 20.955 x 15.2908 mm, as USD has it
    assert len({picture.tobytes() for picture in pictures}) == 3

    done = echousd_command(*words, tmp_path / "x.png")
    assert (done.code, "with --cameras the output is a folder" in done.err) == (2, True)
    assert "which --cameras does not use" in echousd_command(*words, tmp_path / "s", "--view", "top").err
    (tmp_path / "shots/door.png").write_bytes(b"mine")
    done = echousd_command(*words, tmp_path / "shots")
    assert (done.code, "no picture of echousd" in done.err) == (2, True)


WITHOUT_JSON = {
    "plugin-path",
    "train",
    "build",
    "rooms",
    "plot",
    "meshes",
    "to-usd",
    "to-sgfront",
    "import",
    "search",
}


def test_every_command_with_results_has_json():
    def leaves(group):
        for command in group.commands.values():
            yield from leaves(command) if hasattr(command, "commands") else (command,)

    lacking = {c.name for c in leaves(main.command()) if not any("--json" in option.opts for option in c.params)}
    assert lacking <= WITHOUT_JSON


def test_json_of_graphs_and_stores(graph, tmp_path, echousd_command):
    made = read(echousd_command("new", tmp_path / "new.yaml", "--room", "study", "--json").out)
    assert made["written"] == [str(tmp_path / "new.yaml")]
    assert made["objects"] == 4
    store = tmp_path / "store"
    echousd_command("generate", graph, "-o", tmp_path / "room", *BOXES, "--store", store)
    told = read(echousd_command("store", "verify", store, "--json").out)
    assert told["ok"]
    assert told["count"] > 0
    told = read(echousd_command("store", "gc", store, "--dry-run", "--json").out)
    assert (told["gone"], told["dry_run"]) == ([], True)


def test_json_of_libraries_and_of_jobs_for_painters(graph, tmp_path, echousd_command):
    root = tmp_path / "bedroom/bedroom.usda"
    echousd_command("generate", graph, "-o", root.parent, *BOXES)
    index = tmp_path / "library.parquet"
    told = read(echousd_command("assets", "index", root.parent / "assets", "-o", index, "--workers", 1, "--json").out)
    assert told["written"] == [str(index)]
    words = [{*path.name.split("_")} for path in (root.parent / "assets").iterdir()]
    furniture = sum(bool(of & {"plant", "radiator", "shelf"}) for of in words)  # of small things
    assert told["usable"] == 5 + furniture  # the two nightstands are one
    assert told["models"] - told["usable"] == len(told["left_out"])
    told = read(echousd_command("assets", "review", index, "--json").out)
    assert told["written"][0].endswith(".html")

    job = tmp_path / "job"
    told = read(
        echousd_command("texture", "export", root, "-o", job, "--for", "generic", "--resolution", 64, "--json").out
    )
    assert told["written"] == [str(job / "job.json")]
    name = told["objects"][-1]
    (job / "results").mkdir(exist_ok=True)
    Image.new("RGB", (64, 64), "red").save(job / f"results/{name}.png")
    told = read(echousd_command("texture", "import", root, job, "--no-preview", "--json").out)
    assert told["painted"] == [name]
