"""`echousd batch` on the command line: requests, status, verify, JSON lines, and Ctrl-C."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from echousd.batches.options import request_of
from echousd.batches.plan import make_plan, save_plan
from echousd.batches.verify import COLUMNS, write_manifest
from echousd.cli.batch import _clock, _shard


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "neither sources nor a sample; name graph files, or --sample bedroom:20"),
        (("--sample", "cellar:3"), "cellar"),
        (("--sample", "bedroom:1", "--shard", "3"), "--shard is '3', allowed: i/n, such as 0/8"),
        (("--sample", "bedroom:1", "--until", "25:00"), "--until is '25:00', allowed: a time, such as 06:30"),
        (("nothing*.usda",), "no graphs there; allowed"),
        (("a.toml", "b.toml"), "a.toml: cannot be read as TOML"),
    ],
)
def test_a_wrong_command_line_is_one_line_and_leaves_nothing(echousd_command, tmp_path, words, said):
    out = tmp_path / "run"
    outcome = echousd_command("batch", *(words or ("-o", out)), *(("-o", out) if words else ()))
    assert outcome.code == 2
    assert said in outcome.err
    assert not out.exists()


def test_status_and_verify_of_a_run_that_has_not_begun(echousd_command, tmp_path):
    save_plan(make_plan(request_of({"sample": {"bedroom": 3}}, "test"), "abc"), tmp_path)
    outcome = echousd_command("batch", "status", tmp_path)
    assert (outcome.code, outcome.out) == (0, "rooms    0 of 3 done, 0 failed, 3 to go\n")
    assert json.loads(echousd_command("batch", "status", tmp_path, "--json").out)["missing"] == 3
    outcome = echousd_command("batch", "verify", tmp_path)
    assert outcome.code == 1
    assert "bedroom_000000: missing" in outcome.out
    outcome = echousd_command("batch", "verify", tmp_path / "none")
    assert outcome.code == 2
    assert "no run of echousd batch" in outcome.err


def test_a_clock_and_a_shard_are_read():
    assert _clock("") is None
    assert 0 < _clock("06:30") - time.time() <= 24 * 3600
    assert _shard("3/8") == (3, 8)


def test_the_manifest_is_a_table_where_pyarrow_is_installed(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    plan = make_plan(request_of({"sample": {"bedroom": 2}}, "test"), "abc")
    save_plan(plan, tmp_path)
    write_manifest(plan, tmp_path)
    table = parquet.read_table(tmp_path / "manifest.parquet")
    assert table.column_names == list(COLUMNS)
    assert table.column("id").to_pylist() == ["bedroom_000000", "bedroom_000001"]


@pytest.mark.skipif(os.name != "posix", reason="Ctrl-C is a signal of POSIX systems here")
def test_ctrl_c_ends_a_run_within_seconds(tmp_path):
    script = "from echousd.cli.main import main\nif __name__ == '__main__': main()\n"
    (tmp_path / "run.py").write_text(script)
    words = ["batch", "--sample", "bedroom:40", "--shapes", "boxes", "--workers", "1", "-o", "out"]
    run = subprocess.Popen(
        [sys.executable, "run.py", *words],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores it
    )
    until = time.monotonic() + 120
    while not (tmp_path / "out" / ".batch" / "shard_0_of_1" / "journal.jsonl").is_file() and time.monotonic() < until:
        time.sleep(0.1)
    time.sleep(1)
    began = time.monotonic()
    os.killpg(run.pid, signal.SIGINT)
    _, said = run.communicate(timeout=60)
    assert time.monotonic() - began < 5
    assert run.returncode == 130
    assert said.splitlines()[-1] == "error: interrupted"


def test_a_run_goes_on_without_its_sources(echousd_command, tmp_path, monkeypatch):
    (tmp_path / "graphs").mkdir()
    (tmp_path / "graphs" / "a.yaml").write_text("room: bedroom\nobjects: {bed: double_bed}\n")
    monkeypatch.chdir(tmp_path)
    quick = ("--shapes", "boxes", "--dress", "none", "--no-preview", "--workers", "1")
    assert echousd_command("batch", "graphs", "--count", "2", *quick, "-o", "run").code == 0
    made = sorted((tmp_path / "run/rooms/0000").iterdir())
    (made[1] / f"{made[1].name}.usda").unlink()
    (tmp_path / "graphs" / "a.yaml").unlink()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    outcome = echousd_command("batch", "-o", "../run", "--resume", "--workers", "1")
    assert (outcome.code, "2 of 2" in outcome.out) == (0, True), outcome.err


def test_a_run_goes_on_as_it_was_asked(echousd_command, tmp_path):
    asked = ("--sample", "bedroom:2", "--shapes", "boxes", "--dress", "none", "--no-preview", "--workers", "1")
    assert echousd_command("batch", *asked, "--seed", "5", "-o", tmp_path / "run").code == 0
    rooms = sorted((tmp_path / "run/rooms/0000").iterdir())
    (rooms[1] / f"{rooms[1].name}.usda").unlink()
    outcome = echousd_command("batch", "-o", tmp_path / "run", "--resume", "--workers", "1")
    assert (outcome.code, "2 of 2" in outcome.out) == (0, True), outcome.err
    assert echousd_command("batch", "verify", tmp_path / "run").code == 0
    outcome = echousd_command("batch", "-o", tmp_path / "none", "--resume")
    assert (outcome.code, "no run of echousd batch" in outcome.err) == (2, True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sources = 5", "batch.toml: sources is 5, allowed: a list of files, folders, globs"),
        ("sources = [5]", "batch.toml: sources.0 is 5, allowed"),
        ("sample = 5", "batch.toml: sample is 5, allowed: room types"),
    ],
)
def test_a_batch_toml_of_other_types_is_told(echousd_command, tmp_path, text, said):
    (tmp_path / "batch.toml").write_text(text)
    outcome = echousd_command("batch", tmp_path / "batch.toml", "-o", tmp_path / "run")
    assert outcome.code == 2
    assert said in outcome.err
