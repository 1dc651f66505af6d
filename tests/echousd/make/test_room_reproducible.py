"""The same bytes whatever the machine offers: threads, cores, locale, hash seed, folder, warm or cold."""

import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import torch
from small_room import BARE, small_graph

import echousd
from echomodel.boxes import Boxes
from echomodel.compact.shape import _decoded
from echomodel.echo import EchoModel
from echousd.graph.arrays import DESCRIPTION, DISTANCE, one_thread, rounded, rounded_boxes

CODE = textwrap.dedent("""
    import hashlib, os, sys
    import torch
    if sys.argv[1] == "warm":
        torch.randn(64, 64) @ torch.randn(64, 64)
    torch.set_num_threads(int(sys.argv[2]))
    import echousd
    from echousd.graph import load_graph
    from echousd.layers.compose import room_files
    for shapes in sys.argv[4:]:
        graph = load_graph(sys.argv[3])
        if shapes == "sdf":
            graph = echousd.SceneGraph(graph.room, (echousd.Node("table", "coffee_table"),))  # quick to take apart
        options = echousd.RoomOptions(walls=shapes == "parts", dress="some" if shapes == "parts" else "none")
        room = echousd.generate(graph, seed=3, steps=3, faces=400, shapes=shapes, drafts=2, options=options)
        assert torch.get_num_threads() == int(sys.argv[2])
        for path, content in sorted(room_files(room).items()):
            print(shapes, path, hashlib.sha256(content).hexdigest())
""")
GRAPH = """
room: {type: bedroom, size: [4.0, 3.4]}
objects: {bed: double_bed, stand: nightstand, lamp: table_lamp, tall: wardrobe}
relations: [stand close by bed, lamp standing on stand, tall taller than bed]
"""


def run(folder, *shapes, threads=1, warm="cold", cores=None, **environment):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "room.yaml").write_text(GRAPH)
    paths = os.pathsep.join(path for path in sys.path if path)
    command = [sys.executable, "-c", CODE, warm, str(threads), str(folder / "room.yaml"), *shapes]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=folder, check=False,
        env={**os.environ, "OMP_NUM_THREADS": str(threads), "PYTHONPATH": paths, **environment},
        preexec_fn=(lambda: os.sched_setaffinity(0, cores)) if cores else None,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    return run(tmp_path_factory.mktemp("alone"), "parts", "sdf")


def test_threads_do_not_show(tmp_path, alone):
    found = run(tmp_path, "parts", "sdf", threads=4, warm="warm")
    assert sum(line.startswith("sdf ") for line in found) > 10
    assert [line.split()[0] for line in found if "layers/dressing.usda" in line] == ["parts"]
    assert found == alone


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system pins no process to a core")
def test_one_core_another_folder_locale_and_hash_seed_do_not_show(tmp_path, alone):
    core = {min(os.sched_getaffinity(0))}
    words = {"PYTHONHASHSEED": "99", "LC_ALL": "C", "LANG": "C", "TZ": "Asia/Kolkata"}
    found = run(tmp_path / "an other/place", "parts", cores=core, threads=4, **words)
    assert found == [line for line in alone if line.startswith("parts ")]


def test_stages_hand_on_rounded_numbers():
    noise = 4e-7
    size = torch.tensor([[1.23456789, 0.5, 2.0]])
    position, yaw = torch.tensor([[0.1000004, 0.0, -1.99996]]), torch.tensor([np.pi / 2 + 1e-6])
    graph = small_graph()
    graph = graph.replaced(nodes=graph.nodes[:1], relations=())
    one = rounded_boxes(graph, Boxes(size, position, yaw))
    two = rounded_boxes(graph, Boxes(size + noise, position - noise, yaw + noise))
    for a, b in ((one.size, two.size), (one.position, two.position), (one.yaw, two.yaw)):
        assert np.array_equal(a, b)
    assert one.size[0].tolist() == pytest.approx([1.2346, 0.5, 2.0], abs=1e-7)
    assert one.position[0].tolist() == pytest.approx([0.1, 0.0, -2.0], abs=1e-7)
    assert float(np.rad2deg(one.yaw)[0]) == pytest.approx(90.0, abs=1e-4)


@pytest.mark.parametrize(("drawn", "written"), [(-269.56, 90.44), (450.0, 90.0), (180.0, 180.0), (-180.0, -180.0)])
def test_nothing_is_turned_by_more_than_half_a_turn(drawn, written):
    graph = small_graph()
    graph = graph.replaced(nodes=graph.nodes[:1], relations=())
    yaw = torch.deg2rad(torch.tensor([drawn]))
    found = rounded_boxes(graph, Boxes(torch.ones(1, 3), torch.ones(1, 3), yaw))
    assert float(np.rad2deg(found.yaw)[0]) == pytest.approx(written, abs=1e-3)


def test_what_the_graph_fixes_is_not_rounded():
    graph = small_graph()
    bed = graph.nodes[0].replaced(size=(1.23456, 0.5, 2.0), position=(0.123456, 0.0, 0.0), yaw=0.123456)
    graph = graph.replaced(nodes=(bed,), relations=())
    found = rounded_boxes(graph, Boxes(torch.ones(1, 3), torch.ones(1, 3), torch.ones(1)))
    assert found.size[0, 0] == torch.tensor(1.23456)
    assert found.position[0, 0] == torch.tensor(0.123456)
    assert found.yaw[0] == torch.tensor(0.123456)


@pytest.mark.parametrize("shapes", ["parts", "sdf"])
def test_networks_run_on_one_thread(shapes, monkeypatch):
    echo, seen = EchoModel.load(), []
    for name in ("sample_layout", "sample_furniture", "sample_shapes"):
        told = getattr(echo, name)
        monkeypatch.setattr(
            echo, name, lambda *a, f=told, n=name, **k: seen.append((n, torch.get_num_threads())) or f(*a, **k)
        )
    graph = small_graph()
    graph = graph.replaced(nodes=graph.nodes[:1], relations=())
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        echousd.generate(graph, model=echo, shapes=shapes, steps=1, drafts=1, faces=100, place=False, **BARE)
    finally:
        torch.set_num_threads(before)
    assert seen == [("sample_layout", 1), ("sample_furniture" if shapes == "parts" else "sample_shapes", 1)]


def test_codes_are_rounded_before_they_are_decoded(monkeypatch):
    echo, seen = EchoModel.load(), []
    coder = echo.model.autoencoder
    monkeypatch.setattr(coder, "decode", lambda x, f=coder.decode: seen.append(x) or f(x))
    codes = torch.randn(2, echo.config.shape.components, generator=torch.Generator().manual_seed(0)).round(decimals=3)
    one, two = (_decoded(echo.model, codes + noise) for noise in (0.0, 4e-6))
    assert torch.equal(seen[0], seen[1])
    assert torch.equal(one, two)
    assert torch.equal(one, (one / 1e-4).round() * 1e-4)


def test_grids_are_rounded_and_threads_come_back():
    grid = np.full((1, 2, 2, 2), 0.01234567, np.float32)
    assert (rounded(grid, DISTANCE) == rounded(grid + 1e-6, DISTANCE)).all()
    told = np.full((2, 3), 0.123456, np.float32)
    assert (rounded(told, DESCRIPTION) == rounded(told + 2e-6, DESCRIPTION)).all()
    before = torch.get_num_threads()
    with one_thread():
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == before
