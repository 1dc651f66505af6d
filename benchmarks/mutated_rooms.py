"""One wrong value at a time in a finished room, for every property and every command, in pieces that can be ended.

    OMP_NUM_THREADS=1 nice -n 5 python benchmarks/mutated_rooms.py --commands quick --seconds 3000 --log faults.txt

Every command must work, or end in one line that names the file or the prim (exit code 0, 1 or 2), within a minute of
the processor and 4 GB. Mutations come in a random order, so that a run that was ended has tried an honest sample.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
import warnings
from pathlib import Path

from pxr import Usd

from echousd.cli.main import run

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/strategies"))
from mutations import COMMANDS, SHAPES, VALUES, Mutation, mutate, properties
from small_room import StandIn, small_graph

GROUPS = {
    "quick": ("check", "graph", "usdz", "render", "graph --json", "check --json", "new", "render top", "usda"),
    "slow": ("edit", "glb", "generate", "graph --png"),
    "all": tuple(COMMANDS),
}
PIECE = 200  # mutations of one process
SECONDS = 60  # of the processor for one command
MEMORY = 12 << 30  # address space of one process, most of it never touched
GROWTH = 4 << 20  # kB that one command may add


class Hang(BaseException):
    """A command that does not end."""


def fault(room: Path, mutation: Mutation, command: str, folder: Path) -> str:
    """What is wrong with how a command takes a mutation, "" for nothing."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(room.parent, folder / room.parent.name)
    mutant = folder / room.parent.name / room.name
    mutate(mutant, mutation)
    out, err = io.StringIO(), io.StringIO()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = run(COMMANDS[command](mutant, folder / "out"))
    except Hang:
        return f"does not end in {SECONDS} s"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    last = (err.getvalue().strip().splitlines() or [""])[-1]
    if code not in (0, 1, 2):
        return f"exit code {code}: {last}"
    if code == 2 and not (str(folder) in last or "</" in last):
        return f"names neither file nor prim: {last}"
    if "\x1b" in out.getvalue() + err.getvalue():
        return "a control character on the terminal"
    return f"{grown >> 10} MB more memory" if grown > GROWTH else ""


def piece(room: Path, pairs: list[tuple[Mutation, str]], log: Path, scratch: Path) -> None:
    """Run pairs of mutation and command; write each before it runs, and what was wrong with it."""

    def stop(*_: object) -> None:
        raise Hang

    signal.signal(signal.SIGPROF, stop)
    warnings.simplefilter("ignore")
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for mutation, command in pairs:
        (scratch / "now").write_text(f"echousd {command} with {mutation}")
        found = fault(room, mutation, command, scratch / "room")
        if found:
            with log.open("a") as file:
                file.write(f"echousd {command} with {mutation}: {found}\n")
        with (scratch / "done").open("a") as file:
            file.write(".")


def main() -> None:
    """Print how many pairs of mutation and command were tried; faults are in the log."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", choices=GROUPS, default="quick")
    parser.add_argument("--room", type=Path, help="root layer of a room that is there (default: a small one of boxes)")
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--log", type=Path, default=Path("faults.txt"))
    asked = parser.parse_args()
    import echousd.make.pipeline
    import echousd.make.save

    if asked.room is None:
        echousd.make.pipeline.load_model = lambda *_, **__: StandIn()  # type: ignore[assignment]
    echousd.make.save.PREVIEW = 16
    with tempfile.TemporaryDirectory(prefix="echousd-mutations-") as place:
        scratch = Path(place)
        room = asked.room
        if room is None:
            made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False)
            room = made.save(scratch / "made/bedroom", preview=False)
        mutations = [
            Mutation(path, value, shape)
            for path in properties(Usd.Stage.Open(str(room)))
            for value in VALUES
            for shape in (SHAPES if value == "nan" else SHAPES[:1])
        ]
        random.Random(asked.seed).shuffle(mutations)
        group = GROUPS[asked.commands]
        # every mutation once, then once more with the next command: a run that was ended has seen every mutation
        pairs = [(m, group[(i + turn) % len(group)]) for turn in range(len(group)) for i, m in enumerate(mutations)]
        until, begun, ended = time.monotonic() + asked.seconds, 0, 0
        while begun < len(pairs) and time.monotonic() < until:
            chosen = pairs[begun : begun + PIECE]
            (scratch / "done").write_text("")
            child = os.fork()
            if not child:
                with contextlib.redirect_stdout(None):
                    piece(room, chosen, asked.log, scratch)
                os._exit(0)
            end = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
            done = len((scratch / "done").read_text())
            if end:
                with asked.log.open("a") as file:
                    file.write(f"{(scratch / 'now').read_text()}: the process ended with {end}\n")
                done += 1
            begun, ended = begun + done, ended + bool(end)
            told = f"{begun} of {len(pairs)} pairs of {len(mutations)} mutations and a command tried"
            print(f"{told}, {ended} processes died", flush=True)


if __name__ == "__main__":
    main()
