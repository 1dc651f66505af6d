"""Floors on which a room would take gigabytes are refused with the number."""

from __future__ import annotations

import pytest

from echousd.checks.report import find_living
from echousd.graph import GraphError, RoomSpec
from echousd.graph.floors import LARGEST, check_extents
from echousd.stage.contents import RoomContents


@pytest.mark.parametrize(
    "room",
    [
        "room: {type: bedroom, size: [5000.0, 5000.0]}\nobjects: {bed: double_bed}\n",
        "room: {type: bedroom, floor_polygon: [[0, 0], [9000, 9000], [9000, 9001]]}\nobjects: {stool: stool}\n",
    ],
    ids=["size", "corners"],
)
def test_generate_refuses_large_floors(tmp_path, room, echousd_command):
    (tmp_path / "graph.yaml").write_text(room)
    done = echousd_command("generate", tmp_path / "graph.yaml", "-o", tmp_path / "room", "--shapes", "boxes")
    assert done.code == 2
    assert "is too large, allowed: 10000 m² around it" in done.err
    assert "graph.yaml" in done.err
    assert not (tmp_path / "room").exists()


def test_limit():
    check_extents(None)
    check_extents((100.0, LARGEST / 100))
    with pytest.raises(GraphError, match=r"floor of 1e\+06 x 1e\+06 m is too large"):
        check_extents((1e6, 1e6))


def test_check_says_what_it_leaves_out():
    room = RoomContents("/Room", RoomSpec("bedroom", size=(5000.0, 5000.0)), (object(),), (), ())
    with pytest.warns(UserWarning, match=r"</Room>: the floor of 5000 x 5000 m is too large.*nobody's ways"):
        assert find_living(room) == ()
