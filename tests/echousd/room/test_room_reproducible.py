"""The same bytes whatever the machine offers: threads, cores, locale, hash seed, folder, warm or cold."""

import os
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import torch
from small_room import small_graph

from echomodel.boxes import Boxes
from echousd.room.reproducible import one_thread, rounded_boxes, rounded_grids

CODE = textwrap.dedent("""
    import hashlib, os, sys
    import torch
    if sys.argv[1] == "warm":
        torch.randn(64, 64) @ torch.randn(64, 64)
    torch.set_num_threads(int(sys.argv[2]))
    import echousd
    from echousd.graph import load_graph
    from echousd.room.compose import room_files
    graph = load_graph(sys.argv[3])
    options = echousd.RoomOptions(walls=True, dress="some")
    room = echousd.generate(graph, seed=3, steps=3, faces=400, options=options)
    assert torch.get_num_threads() == int(sys.argv[2])
    for path, content in sorted(room_files(room).items()):
        print(path, hashlib.sha256(content).hexdigest())
""")
GRAPH = """
room: {type: bedroom, size: [4.0, 3.4]}
objects: {bed: double_bed, stand: nightstand, lamp: table_lamp, tall: wardrobe}
relations: [stand close by bed, lamp standing on stand, tall taller than bed]
"""


def run(folder, *, threads=1, warm="cold", cores=None, **environment):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "room.yaml").write_text(GRAPH)
    paths = os.pathsep.join(path for path in sys.path if path)
    command = [sys.executable, "-c", CODE, warm, str(threads), str(folder / "room.yaml")]
    done = subprocess.run(
        command, capture_output=True, text=True, cwd=folder, check=False,
        env={**os.environ, "OMP_NUM_THREADS": str(threads), "PYTHONPATH": paths, **environment},
        preexec_fn=(lambda: os.sched_setaffinity(0, cores)) if cores else None,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    return run(tmp_path_factory.mktemp("alone"))


@pytest.mark.parametrize("threads", [2, 4])
def test_threads_do_not_show(tmp_path, alone, threads):
    found = run(tmp_path, threads=threads, warm="warm")
    assert len(found) > 10
    assert found == alone


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system pins no process to a core")
def test_one_core_another_folder_locale_and_hash_seed_do_not_show(tmp_path, alone):
    core = {min(os.sched_getaffinity(0))}
    words = {"PYTHONHASHSEED": "99", "LC_ALL": "C", "LANG": "C", "TZ": "Asia/Kolkata"}
    assert run(tmp_path / "an other/place", cores=core, threads=4, **words) == alone


def test_stages_hand_on_rounded_numbers():
    noise = 4e-7
    size = torch.tensor([[1.23456789, 0.5, 2.0]])
    position, yaw = torch.tensor([[0.1000004, 0.0, -1.99996]]), torch.tensor([np.pi / 2 + 1e-6])
    graph = small_graph()
    graph = graph.replaced(nodes=graph.nodes[:1], relations=())
    one = rounded_boxes(graph, Boxes(size, position, yaw))
    two = rounded_boxes(graph, Boxes(size + noise, position - noise, yaw + noise))
    for a, b in ((one.size, two.size), (one.position, two.position), (one.yaw, two.yaw)):
        assert torch.equal(a, b)
    assert one.size[0].tolist() == pytest.approx([1.2346, 0.5, 2.0], abs=1e-7)
    assert one.position[0].tolist() == pytest.approx([0.1, 0.0, -2.0], abs=1e-7)
    assert float(torch.rad2deg(one.yaw)[0]) == pytest.approx(90.0, abs=1e-4)


def test_what_the_graph_fixes_is_not_rounded():
    graph = small_graph()
    bed = graph.nodes[0].replaced(size=(1.23456, 0.5, 2.0), position=(0.123456, 0.0, 0.0), yaw=0.123456)
    graph = graph.replaced(nodes=(bed,), relations=())
    found = rounded_boxes(graph, Boxes(torch.ones(1, 3), torch.ones(1, 3), torch.ones(1)))
    assert found.size[0, 0] == torch.tensor(1.23456)
    assert found.position[0, 0] == torch.tensor(0.123456)
    assert found.yaw[0] == torch.tensor(0.123456)


def test_grids_are_rounded_and_threads_come_back():
    grid = np.full((1, 2, 2, 2), 0.01234567, np.float32)
    assert (rounded_grids(grid) == rounded_grids(grid + 1e-6)).all()
    assert rounded_grids(grid).dtype == np.float32
    before = torch.get_num_threads()
    with one_thread():
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == before
