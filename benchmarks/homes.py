"""Homes drawn by lot, made as `echousd generate` makes them, and what `check` finds: of the whole and room by room.

    python benchmarks/homes.py [--count 12] [--draw 1] [-o FOLDER]

A home has a hall or a living room in its middle and two to six rooms about it, each behind a door or open to it, on 10
to 18 square metres a room; rooms hold what `echousd new` gives them, without small things, and have no picture.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from echousd.folder.manifest import find_manifest
from echousd.graph import GraphError
from echousd.home.assemble import FOLDER, generate_home
from echousd.home.check import check_home
from echousd.home.graph import HomeGraph

CENTRES = ("hall", "living_room", "living_dining")
ABOUT = (
    "bedroom",
    "bedroom",
    "kids_room",
    "study",
    "kitchen",
    "bathroom",
    "dining_room",
    "living_room",
    "utility_room",
)
OPEN = ("kitchen", "living_room", "dining_room")  # which need no door
EACH = (10.0, 18.0)  # square metres a room


def drawn(luck: np.random.Generator) -> HomeGraph:
    """A home by lot."""
    centre = str(luck.choice(CENTRES))
    chosen = luck.choice(len(ABOUT), luck.integers(2, 7), replace=False)
    words = [f"{ABOUT[k]}{'_2' if k == 1 else ''}" for k in sorted(chosen) if ABOUT[k] != centre]
    ways = ["open_to" if word in OPEN and luck.random() < 0.5 else "door" for word in words]
    area = round(float((len(words) + 1) * luck.uniform(*EACH)))
    return HomeGraph.from_words(", ".join(f"{centre} {way} {w}" for way, w in zip(ways, words, strict=True)), area=area)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--draw", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    folder = options.output or Path(tempfile.mkdtemp())
    luck, whole, clean, rooms, said = np.random.default_rng(options.draw), 0, 0, 0, Counter[str]()
    planned = 0
    for number in range(options.count):
        home = drawn(luck)
        try:
            made = generate_home(home, folder / str(number), seed=number, dress="none", preview=False)
        except GraphError as error:
            print(f"{number:3d} no plan: {error}", flush=True)
            continue
        planned += 1
        report = check_home(made.root)
        faults = [f"{kind}: {says}" for kind, says in report.faults] + [
            f"failed: {why}" for why in made.failed.values()
        ]
        said.update(kind for kind, _ in report.faults)
        whole += not faults
        for name, one in report.rooms.items():
            found = [f"{fault.rule}: {fault.says}" for layout in one.layouts for fault in layout.living]
            found += [f"broken: {broken}" for layout in one.layouts for broken in layout.broken]
            found += [f"collision: {hit}" for hit in one.collisions] + [f"placement: {at}" for at in one.placement]
            left = (find_manifest(made.root.parent / FOLDER / name) or {}).get("notes", [])
            said.update(text.split(":")[0] for text in found)
            said.update("left out" for note in left if note.startswith("left out"))
            faults += [f"{name}: {text}" for text in found]
            rooms, clean = rooms + 1, clean + (not found)
        print(f"{number:3d} {len(home.rooms)} rooms, {home.area:g} m2: {'; '.join(faults) or 'nothing'}", flush=True)
    print(f"{planned} homes, {whole} whole; {rooms} rooms, {clean} without any fault ({clean / max(rooms, 1):.2f})")
    print(", ".join(f"{name} {count}" for name, count in said.most_common()))


if __name__ == "__main__":
    main()
