"""A run that is killed again and again, workers and whole, ends with the same bytes as an undisturbed one.

    python benchmarks/batch_faults.py [--rooms 8] [--kills 20] [--longest 60] [--shapes boxes]

Every other kill takes a worker, the others the whole run, at random moments; then the run is gone on with. In the end
every room must be there once, pass the comparison with the journal and, with --check, `echousd check`.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from echousd.batches.journal import read_journals, room_digest
from echousd.batches.plan import load_plan
from echousd.batches.verify import verify


def command(out: Path, options: argparse.Namespace, *, resume: bool) -> list[str]:
    words = ["-c", "from echousd.cli.main import main; main()", "batch", "-o", str(out), "--workers", "2"]
    words += ["--sample", f"bedroom:{options.rooms}", "--shapes", options.shapes, "--no-preview", "--drafts", "1"]
    return [sys.executable, *words, *(["--resume"] if resume else [])]


def workers_of(process: int) -> list[int]:
    """Process ids of the workers of a run (Linux)."""
    children = Path(f"/proc/{process}/task/{process}/children")
    found = [int(word) for word in children.read_text().split()] if children.is_file() else []
    return [child for child in found if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, kind, default in (("rooms", int, 8), ("kills", int, 20), ("longest", float, 60.0), ("seed", int, 0)):
        parser.add_argument(f"--{name}", type=kind, default=default)
    parser.add_argument("--shapes", default="boxes")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as scratch:
        calm, wild = Path(scratch) / "calm", Path(scratch) / "wild"
        began = time.monotonic()
        subprocess.run(command(calm, options, resume=False), check=True, stdout=subprocess.DEVNULL)
        print(f"undisturbed: {options.rooms} rooms in {time.monotonic() - began:.0f} s", flush=True)
        run, kills = None, {"worker": 0, "run": 0}
        for number in range(options.kills):
            if run is None:
                resume = (wild / ".batch" / "plan.jsonl").is_file()
                run = subprocess.Popen(
                    command(wild, options, resume=resume), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
            try:
                run.wait(rng.uniform(0.2, options.longest))
                run = None  # it was faster than the next kill
                continue
            except subprocess.TimeoutExpired:
                pass
            workers = workers_of(run.pid)
            if number % 2 == 0 and workers:
                os.kill(rng.choice(workers), signal.SIGKILL)
                kills["worker"] += 1
            else:
                run.kill()
                run.wait()
                run = None
                kills["run"] += 1
            done = sum(row["state"] == "done" for row in read_journals(wild).values())
            print(f"kill {number + 1}: {kills}, {done} rooms done", flush=True)
        if run is not None:
            run.wait()
        resume = (wild / ".batch" / "plan.jsonl").is_file()
        subprocess.run(command(wild, options, resume=resume), check=True, stdout=subprocess.DEVNULL)
        entries = load_plan(wild).entries
        same = sum(room_digest(wild / entry.path) == room_digest(calm / entry.path) != "" for entry in entries)
        strays = sum(1 for _ in (wild / "rooms").glob("*/*")) - len(entries)
        wrong = list(verify(wild, check=options.check))
        print(f"{same} of {len(entries)} rooms byte-identical, {strays} strays, {len(wrong)} wrong {wrong[:3]}")
        if same < len(entries) or strays or wrong:
            raise SystemExit(1)


if __name__ == "__main__":
    main()
