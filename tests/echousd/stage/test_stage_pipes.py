"""Layers that a stage names and that are no files: USD would wait for a pipe for ever."""

from __future__ import annotations

import os

import pytest

from echousd.stage.encoding import StageError
from echousd.stage.files import open_stage

WAYS = {
    "reference": 'def "A" (references=@./pipe.usda@) {}\n',
    "payload": 'def "A" (payload=@./pipe.usda@) {}\n',
    "deeper": 'def "A" (references=@./between.usda@) {}\n',
    "variant": 'def "A" (prepend variantSets = "v") {\n variantSet "v" = {\n'
    '"a" (references=@./pipe.usda@) {\n}\n}\n}\n',
    "clips": 'def "A" (clips = {\n dictionary default = {\n asset[] assetPaths = [@./pipe.usda@]\n'
    ' string primPath = "/A"\n double2[] active = [(0, 0)]\n }\n }\n) {\n double x = 1\n}\n',
}  # fmt: skip


@pytest.mark.parametrize("way", [*WAYS, "sublayer"])
def test_a_pipe_for_a_layer_is_refused_at_once(tmp_path, way, echousd_command):
    os.mkfifo(tmp_path / "pipe.usda")
    (tmp_path / "between.usda").write_text('#usda 1.0\n(defaultPrim="B")\ndef "B" (references=@./pipe.usda@) {}\n')
    text = WAYS.get(way, "(subLayers=[@./pipe.usda@])\n")
    (tmp_path / "room.usda").write_text(f"#usda 1.0\n{text}")
    with pytest.raises(StageError, match=r"names '.*pipe.usda', not a regular file, allowed: layers"):
        open_stage(tmp_path / "room.usda")
    done = echousd_command("check", tmp_path / "room.usda")
    assert (done.code, "not a regular file" in done.err) == (2, True)


def test_a_name_of_a_layer_that_is_no_text(tmp_path):
    (tmp_path / "room.usda").write_bytes(b"#usda 1.0\n(subLayers=[@./pi\xa0pe.usda@])\n")
    with pytest.raises(StageError, match=r"room.usda: .*UTF-8"):
        open_stage(tmp_path / "room.usda")
