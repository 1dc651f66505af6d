"""Shape sets: the same bytes per seed, resumed where interrupted, read back within the quantisation."""

import pickle
import shutil
from collections.abc import Iterator
from unittest.mock import patch

import numpy as np
import pytest

from echomodel.data import shapeset
from echomodel.data.shapeset import LEVELS, ShapeSet, build_shapes, piece, quantised
from echomodel.tsdf import tsdf_of
from echomodel.vocabulary import vocabulary

COUNT = len(vocabulary().categories)


@pytest.fixture(autouse=True, scope="module")
def solids_are_measured_once() -> Iterator[None]:
    """The grid of the same solids is worked out once: sets differ where their pieces do."""
    known: dict[bytes, np.ndarray] = {}

    def measured(parts):
        key = pickle.dumps(parts)
        if key not in known:
            known[key] = tsdf_of(parts)
        return known[key]

    with patch.object(shapeset, "tsdf_of", measured):
        yield


@pytest.fixture(scope="module")
def smoke(tmp_path_factory):
    directory = tmp_path_factory.mktemp("shapes")
    calls = []
    built = build_shapes(directory, 2, 7, lambda done, total: calls.append((done, total)))
    assert calls == [(COUNT, 2 * COUNT), (2 * COUNT, 2 * COUNT)]
    return built


def test_a_set_holds_every_category_in_every_style(smoke):
    assert len(smoke) == 2 * COUNT
    assert smoke.category.tolist() == list(range(COUNT)) * 2
    assert smoke.style.tolist() == [0] * COUNT + [1] * COUNT
    assert smoke.index_of("s1_chair") == COUNT + smoke.categories.index("chair")
    assert (smoke.size > 0).all()


def test_a_shape_comes_back_within_the_quantisation(smoke):
    index = smoke.index_of("s1_multi_seat_sofa")
    _, size, parts = piece(7, 1, "multi_seat_sofa")
    exact, stored = tsdf_of(parts), smoke[index]
    np.testing.assert_allclose(smoke.size[index], size, rtol=1e-6)
    assert stored.dtype == np.float32
    assert np.abs(exact - stored).max() <= np.diff(LEVELS).max() / 2 + 1e-6
    near = np.abs(exact) < 0.1
    assert np.abs(exact - stored)[near].max() < 0.04  # 0.16 voxels
    np.testing.assert_array_equal(smoke.tsdf([3, index])[1], stored)


def test_few_kilobytes_a_shape(smoke):
    assert sum(p.stat().st_size for p in smoke.directory.iterdir()) / len(smoke) < 6000


def test_an_interrupted_build_goes_on_and_gives_the_same_shapes(smoke, tmp_path, monkeypatch):
    def stop(done, total):
        if done == total:
            raise KeyboardInterrupt

    monkeypatch.setattr(shapeset, "STYLES_PER_SHARD", 1)
    with pytest.raises(KeyboardInterrupt):
        build_shapes(tmp_path, 2, 7, stop)
    kept = (tmp_path / "shapes-0000.bin").stat().st_mtime_ns
    with pytest.raises(ValueError, match="unfinished set, run the build again"):
        ShapeSet(tmp_path)
    again = build_shapes(tmp_path, 2, 7)
    assert (tmp_path / "shapes-0000.bin").stat().st_mtime_ns == kept
    for number in range(2 * COUNT):
        np.testing.assert_array_equal(again.codes(number), smoke.codes(number))


def test_another_seed_in_the_same_folder_is_refused(smoke):
    with pytest.raises(ValueError, match="was begun with seed 7; choose another folder"):
        build_shapes(smoke.directory, 2, 8)
    with pytest.raises(ValueError, match="number of styles is 0"):
        build_shapes(smoke.directory, 0, 7)


def test_damage_is_named(smoke, tmp_path):
    with pytest.raises(ValueError, match=r"not a shape set \(no shapes.json\)"):
        ShapeSet(tmp_path)
    shutil.copytree(smoke.directory, tmp_path, dirs_exist_ok=True)
    shard = tmp_path / "shapes-0000.bin"
    shard.write_bytes(shard.read_bytes()[:-100])
    with pytest.raises(ValueError, match=r"shapes-0000.bin: damaged shard"):
        ShapeSet(tmp_path)
    (tmp_path / "shapes.json").write_text('{"count": 46}')
    with pytest.raises(ValueError, match=r"shapes.json: .* missing: categories \(list\)"):
        ShapeSet(tmp_path)


def test_names_outside_the_set_are_refused(smoke):
    with pytest.raises(ValueError, match="not a shape of this set"):
        smoke.index_of("chair")
    with pytest.raises(ValueError, match="the set has styles 0 to 1"):
        smoke.index_of("s2_chair")


def test_levels_are_fine_about_the_surface():
    values = np.linspace(-1, 1, 4001, dtype=np.float32)
    error = np.abs(LEVELS[quantised(values)] - values)
    assert error[np.abs(values) < 0.1].max() < 0.035
    assert error.max() < 0.14
