"""How often the same thing is met in many rooms: small things by shape, pictures, rugs and cushions by their prints.

    python benchmarks/repetition.py ROOMS... [--top 15]

Arguments are folders of rooms. What counts as the same is what counts in `echousd eval suite --only repetition`.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from pxr import Usd

from echousd.evaluation.sections import things
from echousd.folder.found import room_at


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rooms", nargs="+", type=Path)
    parser.add_argument("--top", type=int, default=15)
    asked = parser.parse_args()
    rooms = [things(Usd.Stage.Open(str(room_at(folder)))) for folder in asked.rooms]
    met = Counter(thing for room in rooms for thing in room)
    kinds = Counter(label for label, *_ in met)
    print(f"{len(rooms)} rooms, {len(met)} different things of {len(kinds)} kinds\n")
    print("| thing | rooms | different ones of its kind |\n|---|---|---|")
    for (label, *names), count in met.most_common(asked.top):
        print(f"| {label}, {', '.join(names)} | {count} | {kinds[label]} |")


if __name__ == "__main__":
    main()
