"""Another program's crash and endless loop are told, and do not end ours."""

import numpy as np
import pytest
import trimesh

from echousd.shapes import charts as module
from echousd.shapes.charts import charts

CRASH = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
BOX = trimesh.creation.box((1.0, 2.0, 0.6))
MESH = 100 * np.asarray(BOX.vertices), np.asarray(BOX.faces)


@pytest.fixture
def child(tmp_path, monkeypatch):
    """Put other code in the place of the process that calls xatlas."""

    def put(code):
        path = tmp_path / "child.py"
        path.write_text(code)
        monkeypatch.setattr(module, "HERE", path)

    return put


def test_charts_lie_apart_in_their_pictures():
    first, second, alone = charts([[MESH, MESH], [MESH]], 256, 4)
    for origin, faces, st in (first, second, alone):
        assert np.array_equal(MESH[0][origin][faces], MESH[0][MESH[1]])
        assert st.min() >= 0
        assert st.max() <= 1
    shared = np.concatenate([first[2][first[1]], second[2][second[1]]]).reshape(-1, 3, 2)
    edges = shared[:, 1:] - shared[:, :1]
    area = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]).sum() / 2
    centres = shared.mean(1)
    assert len(np.unique(centres.round(5), axis=0)) == len(shared)
    assert 0.2 < area < 1.0
    assert alone[2].max() > 0.95


def test_what_always_crashes_is_told(child):
    child(CRASH)
    with pytest.raises(ValueError, match=r"xatlas ends the program \(-11\) over 12 triangles, allowed: meshes that it"):
        charts([[MESH]], 256, 4)


def test_a_race_that_was_lost_is_run_again(child, tmp_path):
    first = tmp_path / "first"
    child(f"import pathlib\np = pathlib.Path({str(first)!r})\nif not p.exists():\n p.touch()\n {CRASH}\n"
          f"exec(compile(open({str(module.HERE)!r}).read(), 'charts', 'exec'))\n")  # fmt: skip
    assert len(charts([[MESH]], 256, 4)) == 1
    assert first.exists()


def test_what_comes_to_no_end_is_told(monkeypatch):
    monkeypatch.setattr(module, "PATIENCE", 2.0)
    far = MESH[0].copy()
    far[0] = 1e30
    with pytest.raises(ValueError, match="xatlas comes to no end in 2 s over 12 triangles"):
        charts([[(far, MESH[1])]], 256, 4)
