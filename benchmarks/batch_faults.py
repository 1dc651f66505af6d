"""A run that is killed again and again, workers and whole, ends with the same bytes as an undisturbed one.

    python benchmarks/batch_faults.py [--rooms 8] [--kills 20] [--pause 10] [--shapes boxes] [--drafts 1] [--calm 1]
        [--check 0] [--folder DIR]

Every other kill takes a worker, the others the whole run, once a random number of rooms is there and up to --pause
seconds later; then the run is gone on with. In the end every room must be there once and be what the journal says,
those of one in --calm packs the same bytes as in an undisturbed run (a shard of the same plan), and --check of them
must pass `echousd check`. --drafts 0: as `batch` has them. --folder keeps both runs, and an undisturbed one that lies
there is taken as it is.
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

from echousd.batches.executor import resident
from echousd.batches.plan import load_plan, read_journals, room_digest
from echousd.batches.verify import verify
from echousd.checks import check


def command(out: Path, options: argparse.Namespace, *, resume: bool = False, shard: str = "0/1") -> list[str]:
    words = ["-c", "from echousd.cli.main import main; main()", "batch", "-o", str(out), "--workers", "2"]
    words += ["--sample", f"bedroom:{options.rooms}", "--shapes", options.shapes, "--no-preview", "--shard", shard]
    words += ["--drafts", str(options.drafts)] if options.drafts else []
    return [sys.executable, *words, *(["--resume"] if resume else [])]


def workers_of(process: int) -> list[int]:
    """Process ids of the workers of a run (Linux)."""
    children = Path(f"/proc/{process}/task/{process}/children")
    found = [int(word) for word in children.read_text().split()] if children.is_file() else []
    return [child for child in found if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()]


def done(run: Path) -> int:
    """How many rooms are there."""
    return sum(row["state"] == "done" for row in read_journals(run).values())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, kind, default in (("rooms", int, 8), ("kills", int, 20), ("pause", float, 10.0), ("seed", int, 0)):
        parser.add_argument(f"--{name}", type=kind, default=default)
    parser.add_argument("--shapes", default="boxes")
    parser.add_argument("--calm", type=int, default=1)
    for name, default in (("drafts", 1), ("check", 0)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--folder", type=Path)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as scratch:
        place = options.folder or Path(scratch)
        calm, wild = place / "calm", place / "wild"
        began = time.monotonic()
        if not calm.is_dir():
            subprocess.run(command(calm, options, shard=f"0/{options.calm}"), check=True, stdout=subprocess.DEVNULL)
        quiet = [name for name, row in read_journals(calm).items() if row["state"] == "done"]
        print(f"undisturbed: {len(quiet)} rooms in {time.monotonic() - began:.0f} s", flush=True)
        run, kills = None, {"worker": 0, "run": 0}
        for number, moment in enumerate(sorted(rng.uniform(0, options.rooms) for _ in range(options.kills))):
            if run is None:
                resume = (wild / ".batch" / "plan.jsonl").is_file()
                run = subprocess.Popen(
                    command(wild, options, resume=resume), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
            while done(wild) < moment and run.poll() is None:
                time.sleep(0.5)
            time.sleep(rng.uniform(0, options.pause))
            workers = workers_of(run.pid)
            held = ", ".join(f"{resident(worker):.0f}" for worker in workers)
            if run.poll() is not None:
                print(f"the run had ended before kill {number + 1}", flush=True)
            if number % 2 == 0 and workers:
                os.kill(rng.choice(workers), signal.SIGKILL)
                kills["worker"] += 1
            else:
                run.kill()
                run.wait()
                run = None
                kills["run"] += 1
            print(f"kill {number + 1}: {kills}, {done(wild)} rooms done, workers held {held} MiB", flush=True)
        if run is not None:
            run.wait()
        resume = (wild / ".batch" / "plan.jsonl").is_file()
        subprocess.run(command(wild, options, resume=resume), check=True, stdout=subprocess.DEVNULL)
        entries = load_plan(wild).entries
        paths = {entry.id: entry.path for entry in entries}
        same = sum(room_digest(wild / paths[name]) == room_digest(calm / paths[name]) != "" for name in quiet)
        strays = sum(1 for _ in (wild / "rooms").glob("*/*")) - len(entries)
        wrong = list(verify(wild))
        chosen = rng.sample(entries, min(options.check, len(entries)))
        print(f"kills: {kills}; {time.monotonic() - began:.0f} s until all was verified", flush=True)
        passed = sum(check(wild / entry.path / f"{entry.id}.usda").ok for entry in chosen)
        print(
            f"{len(entries)} rooms in {time.monotonic() - began:.0f} s with the undisturbed ones: "
            f"{same} of {len(quiet)} byte-identical, {strays} strays, {len(wrong)} wrong {wrong[:3]}, "
            f"{passed} of {len(chosen)} pass check"
        )
        if same < len(quiet) or strays or wrong:
            raise SystemExit(1)


if __name__ == "__main__":
    main()
