"""A run that is killed by the system, and what a room is told to lack."""

import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest
from inline_batches import QUICK, Inline, batch, digests, small

from echousd.batches.plan import read_journals
from echousd.checks.placement import Misplacement


@pytest.mark.skipif(os.name != "posix", reason="kills a process by a signal")
def test_a_killed_run_and_its_killed_worker_leave_the_same_bytes(tmp_path):
    source, folder = small(tmp_path), tmp_path / "calm"
    batch(source, folder, executor=Inline(), workers=1, **QUICK)
    script = (
        "import os, signal, sys\nfrom multiprocessing import active_children\nfrom echousd.batches import batch\n\n"
        "def tell(progress):\n    if progress.made:\n        os.kill(os.getpid(), signal.SIGKILL)\n\n"
        "if __name__ == '__main__':\n"
        "    from echousd.batches.executor import LocalWorkers\n    pool = LocalWorkers(1)\n"
        "    os.kill(active_children()[0].pid, signal.SIGKILL)\n    batch._executor = lambda *_: pool\n"
        f"    batch.batch(sys.argv[1], sys.argv[2], progress=tell, **{QUICK!r})\n"
    )
    (tmp_path / "night.py").write_text(script)
    ended = subprocess.run(
        [sys.executable, str(tmp_path / "night.py"), str(source), str(tmp_path / "run")], check=False
    )
    assert ended.returncode == -signal.SIGKILL
    rooms = [row["room"] for row in read_journals(tmp_path / "run").values() if row["state"] == "done"]
    assert len(rooms) == 1
    again = Inline()
    assert batch(source, tmp_path / "run", executor=again, resume=True, **QUICK).done == 2
    assert rooms[0] not in again.calls
    assert digests(tmp_path / "run") == digests(folder)


def test_what_check_finds_misplaced_is_in_the_row(tmp_path, monkeypatch):
    from echousd import checks

    def floating(root, **given):
        report = checks_check(root, **given)
        layout = replace(report.layouts[0], placement=(Misplacement("desk", "floating", 0.4),))
        return replace(report, layouts=(layout, *report.layouts[1:]))

    checks_check = checks.check
    monkeypatch.setattr(checks, "check", floating)
    batch(small(tmp_path), tmp_path / "run", executor=Inline(), workers=1, **QUICK)
    rows = [row for row in read_journals(tmp_path / "run").values() if row["state"] == "done"]
    assert [(row["check"], row["check_errors"]) for row in rows] == [(False, ["desk is floating"])] * 2
