"""What `check` is blind to: one fault at a time in finished rooms, furniture of their own, of a library and of a store.

    OMP_NUM_THREADS=1 nice -n 5 python benchmarks/sabotaged_rooms.py

A fault is seen if the report names an error or warning that the sound room does not have, or ends in a message.
"""

from __future__ import annotations

import argparse
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from pxr import Usd
from sabotages import Sabotage, sabotages

from echousd.checks import check as check_room
from echousd.cli.main import run

GRAPH = Path(__file__).parents[1] / "samples/bedroom.usda"


def of_files(folder: Path, kind: str) -> dict[str, Callable[[Path], object]]:
    """Faults of the files that a room refers to, below a folder that holds all of them."""
    places = {"own": "own/assets", "library": "own/assets", "stored": "store"}
    found = [path for path in (folder / places[kind]).rglob("*") if path.suffix in (".usda", ".usdc", ".jpg")]
    chosen = {ending: [path for path in found if path.suffix == ending] for ending in (".usda", ".usdc", ".jpg")}
    out: dict[str, Callable[[Path], object]] = {}
    for ending, paths in chosen.items():
        named = [path for path in paths if "wardrobe" in path.name] or paths
        if named:
            name = str(named[0].relative_to(folder))
            out[f"{ending} gone"] = lambda top, name=name: (top / name).unlink()
            out[f"{ending} empty"] = lambda top, name=name: (top / name).write_bytes(b"")
            out[f"{ending} cut in half"] = lambda top, name=name: halved(top / name)
    return out


def halved(path: Path) -> None:
    """The first half of a file."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def seen(root: Path) -> set[str]:
    """What a check tells."""
    try:
        report = check_room(root)
    except ValueError as error:
        return {f"refused: {error}"}
    told = {f"{fault.rule} {fault.prim} {fault.message}" for fault in (*report.errors, *report.warnings)}
    told |= {f"{wrong.problem} {wrong.object}" for wrong in report.placement}
    told |= {f"collision {hit.first} {hit.second}" for hit in report.collisions}
    return told | {f"broken {judged.relation}" for judged in report.broken}


def told_of(thing: str, others: set[str], lines: set[str]) -> bool:
    """Whether a line is about a thing; about the room are those that name no thing."""
    return any(thing in line if thing else not any(other in line for other in others) for line in lines)


def main() -> None:
    """Print the faults that nothing tells, by kind of room, and how many were tried."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="*", default=["own", "library", "stored"])
    parser.add_argument("--keep", type=Path, help="folder for the rooms, used again where they are there")
    parser.add_argument("--share", type=float, default=1.0, help="of the faults that are tried, drawn at random")
    asked = parser.parse_args()
    draw = random.Random(0)
    with tempfile.TemporaryDirectory(prefix="echousd-sabotage-") as scratch:
        rooms = asked.keep or Path(scratch, "rooms")
        made(rooms)
        for kind in asked.kinds:
            tried = blind = 0
            sound = seen(rooms / kind / f"{kind}.usda")
            groups = sabotages(Usd.Stage.Open(str(rooms / kind / f"{kind}.usda")))
            things = {thing for thing in groups if thing}
            for number in range(max(map(len, groups.values()))):  # a fault of each thing at once
                chosen = {
                    thing: list(faults.items())[number] for thing, faults in groups.items() if number < len(faults)
                }
                if draw.random() > asked.share:
                    continue
                tried += len(chosen)
                missed = unsaid(chosen, things, rooms, kind, Path(scratch, f"{kind}{number}"), sound)
                blind += len(missed)
                for thing in missed:
                    print(f"  {kind}: nothing said of: {thing} {chosen[thing][0]}", flush=True)
            for name, sabotage in of_files(rooms, kind).items():
                if draw.random() > asked.share:
                    continue
                top = Path(scratch, f"{kind}_file")
                shutil.copytree(rooms, top)
                sabotage(top)
                tried += 1
                if not {line.replace(str(top), str(rooms)) for line in seen(top / kind / f"{kind}.usda")} - sound:
                    blind += 1
                    print(f"  {kind}: nothing said of: {name}", flush=True)
                shutil.rmtree(top)
            print(f"{kind}: {tried} faults, nothing said of {blind}", flush=True)


def unsaid(
    chosen: dict[str, tuple[str, Sabotage]], things: set[str], rooms: Path, kind: str, top: Path, sound: set[str]
) -> list[str]:
    """The things of whose faults nothing is said; each alone where one of them ends the check with a message."""
    shutil.copytree(rooms, top)
    root = top / kind / f"{kind}.usda"
    stage = Usd.Stage.Open(str(root))
    for _, sabotage in chosen.values():
        sabotage(stage)
    stage.Save()
    del stage
    new = {line.replace(str(top), str(rooms)) for line in seen(root)} - sound
    shutil.rmtree(top)
    if len(chosen) > 1 and any(line.startswith("refused") for line in new):
        each = ({thing: fault} for thing, fault in chosen.items())
        return [thing for one in each for thing in unsaid(one, things, rooms, kind, top, sound)]
    alone = len(chosen) == 1 and bool(new)
    return [thing for thing in chosen if not alone and not told_of(thing, things, new)]


def made(rooms: Path) -> None:
    """A room with furniture of its own, one with that as its library, one in a store."""
    if (rooms / "store").exists():
        return
    rooms.mkdir(parents=True)
    index = str(rooms / "library.parquet")
    for words in (
        ["generate", str(GRAPH), "-o", str(rooms / "own"), "--seed", "7"],
        ["assets", "index", str(rooms / "own/assets"), "-o", index, "--workers", "1"],
        ["generate", str(GRAPH), "-o", str(rooms / "library"), "--seed", "8", "--shapes", "library", "--assets", index],
        ["generate", str(GRAPH), "-o", str(rooms / "stored"), "--seed", "7", "--store", str(rooms / "store")],
    ):
        if run([*words, "--quiet"]):
            raise SystemExit(f"echousd {' '.join(words)} failed")


if __name__ == "__main__":
    main()
