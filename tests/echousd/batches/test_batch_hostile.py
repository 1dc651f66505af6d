"""Folders of runs and sources that somebody sent: one line that names the file, never a wait or a fault of ours."""

from __future__ import annotations

import json
import os
import shutil

import pytest

from echousd.batches.options import BatchRequest
from echousd.batches.plan import is_row, make_plan, save_plan
from echousd.batches.sources import find_graphs
from echousd.batches.verify import finish

WRONG = (None, 5, -1, 1e300, "x", "\0", [], {}, [1], {"a": 1}, True)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    request = BatchRequest(sources=[], sample={"bedroom": 2})
    save_plan(make_plan(request, "0" * 12), folder)
    place = folder / ".batch/shard_0_of_1"
    place.mkdir()
    row = {"room": "bedroom_000000", "when": 1, "state": "done", "root": "bedroom_000000.usda", "bounds": [0.0] * 6,
           "sha256": "12"}  # fmt: skip
    (place / "journal.jsonl").write_text(json.dumps(row) + "\n")
    return folder


def mutants(raw):
    """The data with each of its values replaced, and without it."""
    yield from WRONG
    for key in raw if isinstance(raw, dict) else ():
        yield {name: value for name, value in raw.items() if name != key}
        yield from ({**raw, key: value} for value in WRONG)


@pytest.mark.parametrize("name", ["plan.jsonl", "plan.jsonl:2", "graphs.jsonl", "shard_0_of_1/journal.jsonl"])
def test_any_value_in_the_files_of_a_run(made, name, tmp_path, echousd_command):
    file, _, line = name.partition(":")
    lines = (made / ".batch" / file).read_text().splitlines() or ['{"graph": "a", "text": "{}"}']
    number = int(line or 1) - 1
    shutil.copytree(made, tmp_path / "run")
    for mutant in mutants(json.loads(lines[number])):
        wrong = [*lines[:number], json.dumps(mutant), *lines[number + 1 :]]
        (tmp_path / "run/.batch" / file).write_text("\n".join(wrong) + "\n")
        for command in ("status", "verify"):
            done = echousd_command("batch", command, tmp_path / "run")
            assert done.code in (0, 1, 2), (mutant, done.err)
            assert done.code != 2 or str(tmp_path / "run") in done.err, (mutant, done.err)


@pytest.mark.parametrize(
    "extra",
    [{"living_faults": [1]}, {"check_errors": [None]}, {"licences": [2]}, {"bounds": [1e308] * 6}, {"objects": 2**70},
     {"objects": 1.5}, {"faces": -1}, {"when": 1e300}, {"when": -1}, {"type": "\ud800"},
     {"living_faults": ["\udfff"]}, {"categories": {"\ud800": 1}}, {"seconds": -1}],
)  # fmt: skip
def test_lines_that_no_artefact_can_hold_are_none(made, extra, tmp_path, echousd_command):
    lines = (made / ".batch/shard_0_of_1/journal.jsonl").read_text()
    row = json.loads(lines)
    assert is_row(row)
    assert not is_row({**row, **extra})
    shutil.copytree(made, tmp_path / "run")
    (tmp_path / "run/.batch/shard_0_of_1/journal.jsonl").write_text(json.dumps({**row, **extra}) + "\n")
    assert finish(tmp_path / "run")["missing"] == 2
    assert echousd_command("batch", "verify", tmp_path / "run").code == 1


@pytest.mark.parametrize(
    ("extra", "said"),
    [({"seed": 2**70}, "seed is 1180591620717411303424"), ({"seed": -1}, "seed is -1"),
     ({"origin": "\ud800"}, "origin is"), ({"error": "\ud800"}, "error is"), ({"graph": "\udc80"}, "graph is"),
     ({"draw": ["bedroom", 2**70, 1]}, "draw.1 is"), ({"draw": ["\ud800", 0, 1]}, "draw.0 is")],
)  # fmt: skip
def test_rooms_of_a_plan_that_no_artefact_can_hold_are_refused(made, extra, said, tmp_path, echousd_command):
    shutil.copytree(made, tmp_path / "run")
    head, first, *rest = (made / ".batch/plan.jsonl").read_text().splitlines()
    first = json.dumps({**json.loads(first), **extra})
    (tmp_path / "run/.batch/plan.jsonl").write_text("\n".join([head, first, *rest]) + "\n")
    done = echousd_command("batch", "status", tmp_path / "run")
    assert (done.code, f"line 2: {said}" in done.err) == (2, True)


def test_an_endless_line_of_a_run_is_told(made, tmp_path, echousd_command):
    for name, code in (("plan.jsonl", 2), ("graphs.jsonl", 2), ("shard_0_of_1/journal.jsonl", 0)):
        shutil.copytree(made, tmp_path / code_name(name))
        path = tmp_path / code_name(name) / ".batch" / name
        path.write_bytes(b"")
        os.truncate(path, 40 * 2**20)
        done = echousd_command("batch", "status", tmp_path / code_name(name))
        assert done.code == code
        assert code == 0 or f"{name}, line 1: more than 16777216 bytes" in done.err


def code_name(name):
    return name.partition(".")[0].replace("/", "_")


@pytest.mark.parametrize("name", ["plan.jsonl", "graphs.jsonl", "shard_0_of_1/journal.jsonl"])
@pytest.mark.parametrize("kind", ["pipe", "deep", "folder"])
def test_files_of_a_run_that_are_none(made, name, kind, tmp_path, echousd_command):
    shutil.copytree(made, tmp_path / "run")
    path = tmp_path / "run/.batch" / name
    path.unlink()
    {"pipe": os.mkfifo, "deep": lambda p: p.write_text("[" * 100_000 + "\n"), "folder": os.mkdir}[kind](path)
    for command in ("status", "verify"):
        done = echousd_command("batch", command, tmp_path / "run")
        assert done.code in ((1, 0) if "journal" in name and kind == "deep" else (2,))
        assert done.code != 2 or str(tmp_path / "run") in done.err


def test_tables_of_graphs_are_read_with_doubt(tmp_path, monkeypatch):
    pyarrow = pytest.importorskip("pyarrow")
    import pyarrow.parquet as parquet

    def graphs(column):
        parquet.write_table(pyarrow.table({"graph": column}), tmp_path / "graphs.parquet")
        return list(find_graphs([str(tmp_path / "graphs.parquet")]))

    for column in ([1, 2], [[1]], [None, "[" * 100_000], pyarrow.array([b"\xff"]).cast(pyarrow.binary())):
        assert all("graphs.parquet:" in found.error for found in graphs(column))
    monkeypatch.setattr("echousd.batches.sources.LARGEST", 10)
    with pytest.raises(ValueError, match="bytes when unpacked, allowed: 10"):
        graphs(["x" * 100])
    (tmp_path / "graphs.parquet").write_bytes(b"PAR1 no")
    with pytest.raises(ValueError, match=r"graphs.parquet: no Parquet file with a column 'graph'"):
        list(find_graphs([str(tmp_path / "graphs.parquet")]))
    monkeypatch.setattr("echousd.batches.sources.MAX_BYTES", 100)
    (tmp_path / "long.jsonl").write_text("[" * 1000)
    with pytest.raises(ValueError, match=r"long.jsonl:1: more than 100 characters"):
        list(find_graphs([str(tmp_path / "long.jsonl")]))
