"""Sets of real meshes: what is held out, what cannot be read, and who is named."""

import pytest
import trimesh

from echomodel.data.shapeset import MeshModel, attribution, build_meshes, held_out


def model(key, load=lambda: trimesh.creation.box([0.5, 0.9, 0.5]), category="chair"):
    return MeshModel(key, category, "Chair", "CC0-1.0", "René", "1", load)


def test_a_fifth_of_each_class_is_held_out():
    models = [model(f"Test/{i}") for i in range(20)] + [model(f"Test/t{i}", category="tv") for i in range(10)]
    kept = held_out(models)
    assert len(kept) == 6
    assert sum(key.startswith("Test/t") for key in kept) == 2
    assert held_out(models[::-1]) == kept


def test_what_cannot_be_read_is_told_and_left_out(tmp_path):
    def broken():
        raise ValueError("broken.obj: holds no triangles")

    told, calls = [], []
    models = [model("a"), model("b", broken)]
    built = build_meshes(tmp_path, models, progress=lambda *step: calls.append(step), skipped=told.append)
    assert len(built) == 2
    assert told == ["broken.obj: holds no triangles"]
    assert calls == [(1, 2), (2, 2)]
    assert attribution(models).count("| Chair | René |") == 2
    with pytest.raises(ValueError, match="no model to learn from, allowed: a library with usable models"):
        build_meshes(tmp_path, [])
