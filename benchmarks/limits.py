"""What large inputs cost, what is refused with its number: python benchmarks/limits.py [--only floor] [--scale parts]

Each line is a process of its own: seconds of the processor and peak memory of `echousd.generate` and `save` (one
thread, no preview, the start of Python included), or of reading a text graph alone. What takes more than `--longest`
of these seconds is killed; of what is refused the line is shown. `--scale`: groups of 5 to 400 objects, warm, of one
source of shapes: seconds of the processor to generate and to save, and their growth as a power of the number.
"""

from __future__ import annotations

import argparse
import math
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

TOLD = "import sys, echousd; sys.excepthook = lambda kind, error, trace: print(error)\n"
GENERATE = TOLD + "echousd.generate(sys.argv[1], shapes=sys.argv[3]).save(sys.argv[2], preview=False)"
WARM = (
    TOLD
    + """
import time
from pathlib import Path
small, large, folder, shapes = sys.argv[1:]
echousd.generate(small, shapes=shapes, progress=None).save(Path(folder, "small"), preview=False)
started = time.process_time()
room = echousd.generate(large, shapes=shapes, progress=None)
made = time.process_time() - started
room.save(Path(folder, "large"), preview=False)
print(made, time.process_time() - started - made, len(room.faults))
"""
)
READ = TOLD + "from echousd.graph import load_graph; load_graph(sys.argv[1])"
GROUP = ("dining_table", "chair", "chair", "bookshelf", "floor_lamp")
AROUND = {"chair": "close by", "floor_lamp": "close by"}


@dataclass(frozen=True)
class Case:
    """A measurement: its name, the text of the graph, and the source of shapes ("": the graph is read alone)."""

    name: str
    graph: str
    shapes: str = ""


def groups(count: int) -> str:
    """A graph of so many objects on four square metres each: tables with two chairs and a lamp, and shelves."""
    side = max(3.6, math.sqrt(4 * count))
    words = [f"thing_{i}: {GROUP[i % len(GROUP)]}" for i in range(count)]
    related = [
        f"thing_{i} {AROUND[word]} thing_{i - i % len(GROUP)}"
        for i in range(count)
        if (word := GROUP[i % len(GROUP)]) in AROUND
    ]
    size = f"room: {{type: dining_room, size: [{side:.2f}, {side:.2f}]}}"
    return f"{size}\nobjects: {{{', '.join(words)}}}\nrelations: [{', '.join(related)}]\n"


def round_floor(area: float, corners: int) -> str:
    """A bed on a floor with so many corners, in a square box of `area` square metres."""
    radius = math.sqrt(area) / 2
    angles = [2 * math.pi * i / corners for i in range(corners)]
    floor = ", ".join(f"[{radius * math.cos(a):.4f}, {radius * math.sin(a):.4f}]" for a in angles)
    return f"room: {{type: bedroom, floor_polygon: [{floor}]}}\nobjects: {{bed: double_bed}}\n"


def text_of(megabytes: float, count: int) -> str:
    """A text graph of so many objects that is as long as asked, less a little: its relations fill it up."""
    words = "".join(f"  thing_{i}: chair\n" for i in range(count))
    head = f"room: {{type: living_room, size: [80, 80]}}\nobjects:\n{words}relations:\n"
    lines, length, most = [head], len(head), int(megabytes * 2**20) - 100
    for step in range(1, count):
        for i in range(count - step):
            lines.append(f"  - thing_{i} left of thing_{i + step}\n")
            length += len(lines[-1])
            if length > most:
                return "".join(lines)
    return "".join(lines)


def cases() -> Iterator[Case]:
    """All measurements, the dearest last."""
    for area, corners in ((100, 60), (100, 400), (100, 501), (9_900, 60), (20_000, 60)):
        yield Case(f"floor, {corners} corners, {area:,} m² around it", round_floor(area, corners), "boxes")
    for megabytes, count in ((2, 5_000), (7.9, 5_000), (8.2, 5_000), (1, 5_001)):
        yield Case(f"text graph read, {megabytes:g} MiB, {count:,} objects", text_of(megabytes, count))
    for count in (10, 50, 201):
        yield Case(f"boxes, {count} objects", groups(count), "boxes")
    for count in (10, 50):
        yield Case(f"parts, {count} objects", groups(count), "parts")
    for count in (100, 200):
        yield Case(f"boxes, {count} objects", groups(count), "boxes")
    yield Case("parts, 100 objects", groups(100), "parts")


SIZES = (5, 10, 20, 40, 100, 200, 400)


def scale(shapes: str, longest: int) -> Iterator[str]:
    """Rows of the table of rooms of `SIZES`, each of a process that has made a small room before."""
    first: tuple[int, float] | None = None
    before: tuple[int, float] | None = None
    for count in SIZES:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for file, many in (("small.yaml", SIZES[0]), ("large.yaml", count)):
                (folder / file).write_text(groups(many), "utf-8")
            words = [WARM, str(folder / "small.yaml"), str(folder / "large.yaml"), name, shapes]
            _, peak, how, lines = child(words, folder, longest)
        if how:
            yield f"| {count} | {lines[-1] if lines else how} | | {peak:,.0f} | | | |"
            continue
        made, saved, faults = map(float, lines[-1].split())
        now = count, made + saved
        grown = [f"{math.log(now[1] / t) / math.log(count / n):.2f}" for n, t in filter(None, (before, first))]
        yield f"| {count} | {made:.2f} | {saved:.2f} | {peak:,.0f} | {faults:.0f} | {' | '.join(grown) or '|'} |"
        first, before = first or now, now


def child(words: list[str], folder: Path, longest: int) -> tuple[float, float, str, list[str]]:
    """CPU seconds and peak MiB of a new process, how it ended ("" = well), and what it said."""
    told, environment = folder / "told.txt", {**os.environ, "OMP_NUM_THREADS": "1"}
    with told.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", *words], stdout=output, stderr=subprocess.STDOUT, env=environment,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (longest, longest)),
        )  # fmt: skip
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = code = os.waitstatus_to_exitcode(status)
    lines = told.read_text("utf-8", "replace").replace(str(folder), "").strip().splitlines()
    how = {0: "", -9: f"killed after {longest} s"}.get(code, lines[-1].replace("|", "\\|") if lines else str(code))
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, how, lines


def measured(case: Case, longest: int) -> str:
    """A row of the table: seconds of the processor, peak MiB, and how it ended."""
    with tempfile.TemporaryDirectory() as name:
        graph = Path(name, "graph.yaml")
        graph.write_text(case.graph, "utf-8")
        more = (GENERATE, str(graph), str(Path(name, "room")), case.shapes) if case.shapes else (READ, str(graph))
        spent, peak, how, _ = child([*more], Path(name), longest)
    return f"| {case.name} | {spent:.1f} | {peak:,.0f} | {how or ('made' if case.shapes else 'read')} |"


def main() -> None:
    """Print the table, a row as soon as it is known."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="cases whose name begins so")
    parser.add_argument("--longest", type=int, default=180, help="seconds of the processor for one case")
    parser.add_argument("--scale", default="", help="source of shapes of rooms of 5 to 400 objects")
    options = parser.parse_args()
    if options.scale:
        print("| objects | generate, CPU s | save | MiB at most | faults | growth from the row before | from 5 |")
        print("|---|---|---|---|---|---|---|")
        for row in scale(options.scale, options.longest):
            print(row, flush=True)
        return
    print("| | seconds of the processor | MiB at most | |\n|---|---|---|---|")
    for case in cases():
        if case.name.startswith(options.only):
            print(measured(case, options.longest), flush=True)


if __name__ == "__main__":
    main()
