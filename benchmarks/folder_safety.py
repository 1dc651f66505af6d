"""What becomes of a room's folder when two writers race for it, and when writers are killed at any moment.

    OMP_NUM_THREADS=1 python benchmarks/folder_safety.py --races 60 --kills 60 --commands 12

Every writer is a process of its own: forked with everything loaded, so that many moments are met, or (`--commands`) the
command as a shell starts it, killed at any time from its start on. A race is won or lost as a whole: the folder holds
exactly one writer's room. After a kill the room opens (if there was one), and the same command, run again, gives the
bytes of an undisturbed run.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

from pxr import Usd

import echousd
from echomodel.loading import load_model
from echousd.cli.main import run
from echousd.graph import load_graph
from echousd.make.save import save_layers

GRAPH = Path(__file__).parents[1] / "samples/bedroom.usda"


def bytes_of(folder: Path) -> str:
    """One hash of all files in a folder but the lock, names included."""
    out = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name != ".echousd.lock":
            out.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return out.hexdigest()


def opens(root: Path) -> bool:
    """Whether another process finds a room that composes."""

    def look() -> int:
        stage = Usd.Stage.Open(str(root))
        return 0 if not stage.GetCompositionErrors() and stage.GetPrimAtPath("/Room/Objects").GetChildren() else 1

    return wait_for(start(look)) == 0


def start(task: Callable[[], int], gate: tuple[int, int] | None = None) -> int:
    """A process that runs `task` once the gate is closed, and ends with its result; its id."""
    child = os.fork()
    if child:
        return child
    code = 99
    with contextlib.suppress(BaseException):
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        if gate is not None:
            os.close(gate[1])
            os.read(gate[0], 1)
        code = task()
    os._exit(code)


def wait_for(child: int) -> int:
    """Exit code of a process, or minus the signal that ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def processor_time(child: int) -> float:
    """Seconds that a process has computed; infinite once it has ended."""
    fields = Path(f"/proc/{child}/stat").read_text().rpartition(") ")[2].split()
    return math.inf if fields[0] == "Z" else (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def races(count: int, scratch: Path, told: Counter[str]) -> None:
    """Two processes save different rooms into one folder at the same time; half the folders hold a room already."""
    rooms = [echousd.generate(GRAPH, seed=seed, shapes="boxes") for seed in (1, 2)]
    expected = set()
    for room in rooms:
        save_layers(room, scratch / "alone/room")
        expected.add(bytes_of(scratch / "alone/room"))
        shutil.rmtree(scratch / "alone/room")
    for number in range(count):
        folder = scratch / f"race{number}" / "room"
        if number % 2:
            save_layers(rooms[number // 2 % 2], folder)
        gate = os.pipe()

        def save(room: echousd.Room, folder: Path = folder) -> int:
            try:
                save_layers(room, folder)
            except ValueError as error:
                return 2 if "is writing it" in str(error) else 3
            return 0

        children = [start(lambda room=room, save=save: save(room), gate) for room in rooms]
        os.close(gate[1])
        ends = sorted(wait_for(child) for child in children)
        os.close(gate[0])
        told[{(0, 0): "both, one after the other", (0, 2): "one refused by name"}.get(tuple(ends), f"ends {ends}")] += 1
        told["opens"] += opens(folder / "room.usda")
        told["exactly one writer's room"] += bytes_of(folder) in expected
        shutil.rmtree(folder.parent)
        told["done"] += 1


def forked(words: list[str]) -> int:
    """Id of a process that runs a command with everything loaded."""
    return start(lambda: run(words))


def spawned(words: list[str]) -> int:
    """Id of a process that a shell would start for a command."""
    code = "from echousd.cli.main import main; main()"
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen([sys.executable, "-c", code, *words], **silent).pid


def kills(count: int, scratch: Path, told: Counter[str], begin: Callable[[list[str]], int] = forked) -> None:
    """SIGKILL for `generate` over an old room and for `edit`, half of them while files are being written."""
    said = ["--shapes", "boxes", "--no-place"]
    old = scratch / "old/room"
    if not old.exists():
        run(["generate", str(GRAPH), "-o", str(old), "--seed", "1", *said])
    commands = (
        lambda folder: ["generate", str(GRAPH), "-o", str(folder), "--seed", "2", *said],
        lambda folder: ["edit", str(folder / "room.usda"), "--add", "fern:plant", "--remove", "pendant", *said],
    )
    undisturbed, spent = [], []
    for command in commands:
        folder = scratch / "undisturbed/room"
        shutil.copytree(old, folder)
        _, status, used = os.wait4(begin(command(folder)), 0)
        assert os.waitstatus_to_exitcode(status) in (0, 1)  # without placing things may collide
        spent.append(used.ru_utime + used.ru_stime)
        undisturbed.append(bytes_of(folder))
        shutil.rmtree(folder)
    before = bytes_of(old)
    for number in range(count):
        kind, command = number % 2, commands[number % 2]
        folder = scratch / f"{begin.__name__}{number}" / "room"
        shutil.copytree(old, folder)
        child = begin(command(folder))
        if number // 2 % 2:  # at any time of its own, however busy the machine is
            moment = random.uniform(0, spent[kind])
            while processor_time(child) < moment:
                time.sleep(0.001)
        else:  # while it is writing
            while not (folder / ".echousd").exists() and os.waitpid(child, os.WNOHANG) == (0, 0):
                time.sleep(0.0005)
            time.sleep(random.uniform(0, 0.06))
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        with contextlib.suppress(ChildProcessError):
            told["killed"] += wait_for(child) == -signal.SIGKILL
        told["while writing"] += (folder / ".echousd").exists()
        told["opens at once"] += opens(folder / "room.usda")
        if kind and bytes_of(folder) != undisturbed[kind]:
            stale = (folder / ".echousd/journal.json").exists()
            again = wait_for(forked(command(folder)))
            told["edit was complete with its journal"] += stale and again == 2
        elif not kind:
            wait_for(forked(command(folder)))
        write_missing_preview(folder)
        after = bytes_of(folder)
        if after == before != undisturbed[kind]:
            print(f"  kill {number}: the second run left the old room", flush=True)
        told["same bytes in the end"] += after == undisturbed[kind]
        told["left as before"] += after == before and after != undisturbed[kind]
        shutil.rmtree(folder.parent)
        told["done"] += 1


def write_missing_preview(folder: Path) -> None:
    """The preview comes after the room; who was killed in between has the old one."""
    from echousd.make.save import write_preview

    wait_for(start(lambda: int(write_preview(folder / "room.usda") is None)))


def main() -> None:
    """Print what was counted."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--races", type=int, default=60)
    parser.add_argument("--kills", type=int, default=60)
    parser.add_argument("--commands", type=int, default=0, help="kills of commands as a shell starts them")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    random.seed(asked.seed)
    load_graph(GRAPH)
    load_model(None)
    with tempfile.TemporaryDirectory(prefix="echousd-safety-") as folder:
        for name, count, measure in (
            ("races", asked.races, races),
            ("kills", asked.kills, kills),
            ("kills of commands", asked.commands, partial(kills, begin=spawned)),
        ):
            if count:
                print(f"{count} {name}")
                told: Counter[str] = Counter()
                with contextlib.suppress(KeyboardInterrupt):  # then what was counted so far
                    measure(count, Path(folder), told)
                for what, often in told.items():
                    print(f"  {often:4d} {what}", flush=True)


if __name__ == "__main__":
    main()
