"""Damaged files of a finished room and of what goes into one: commands work, or say which file is at fault.

    OMP_NUM_THREADS=1 nice -n 5 python benchmarks/flipped_files.py --room out/bedroom/bedroom.usda --flips 200

Layers, images and manifests of the room, and its graph as YAML and JSON; each command runs in a process of its own,
within a minute of the processor. Counted are exit codes other than 0, 1 and 2, ends by a signal, messages without a
file or prim, and more than 2 GB of memory.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import Counter
from pathlib import Path

import torch

import echousd
from echomodel.loading import load_model
from echousd.cli.main import run

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/strategies"))
from flips import KINDS, Flip, end_of, fault, files_of, flipped
from small_room import StandIn, small_graph

ROOM = ("check", "graph", "usdz", "render top", "graph --json", "glb", "edit")
GRAPHS = ("bedroom.yaml", "bedroom.json")
WEIGHTS = ("layout.safetensors", "parts.safetensors")


def main() -> None:
    """Print every fault and how many flips were tried by kind of file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--room", type=Path, help="root layer of a finished room (default: a small one of boxes)")
    parser.add_argument("--flips", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    torch.set_num_threads(1)  # threads do not survive a fork
    load_model(None)
    import echousd.make.pipeline
    import echousd.make.save

    echousd.make.save.PREVIEW = 16
    draw, tried, wrong = random.Random(asked.seed), Counter[str](), 0
    with tempfile.TemporaryDirectory(prefix="echousd-flips-") as scratch:
        room = asked.room
        if room is None:
            echousd.make.pipeline.load_model = lambda *_, **__: StandIn()  # type: ignore[assignment]
            made = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False)
            room = made.save(Path(scratch) / "made/bedroom", preview=False)
        names = files_of(room)
        for number in range(asked.flips):
            kind = draw.choice(KINDS)
            if number % 5:
                flip = Flip(draw.choice(names), kind, number)
                command = draw.choice(ROOM)
                found = fault(room, flip, command)
            else:
                flip = Flip(draw.choice((*GRAPHS, *WEIGHTS)), kind, number)
                command, found = _alone(flip, Path(scratch) / f"alone{number}")
            tried[Path(flip.path).suffix] += 1
            if found:
                wrong += 1
                print(f"echousd {command} with {flip}: {found}", flush=True)
    told = ", ".join(f"{count} of {ending}" for ending, count in tried.most_common())
    print(f"{asked.flips} damaged files ({told}): {wrong} faults")


def _alone(flip: Flip, folder: Path) -> tuple[str, str]:
    """The command that reads a graph or weights, and what is wrong with how it takes the damaged ones."""
    folder.mkdir()
    path = folder / flip.path
    if path.suffix == ".safetensors":
        for source in (Path(echousd.__file__).parents[1] / "model/echomodel/weights").glob("*.safetensors"):
            (folder / source.name).symlink_to(source)
        content = path.read_bytes()
        path.unlink()
        path.write_bytes(flipped(content, flip))
        graph = Path(__file__).parents[1] / "samples/bedroom.yaml"
        words = ["generate", str(graph), "-o", str(folder / "room"), "--weights", str(folder), "--shapes", "boxes"]
        return "generate --weights", end_of([*words], folder)
    assert run(["new", str(path), "--from", str(Path(__file__).parents[1] / "samples/bedroom.yaml")]) == 0
    path.write_bytes(flipped(path.read_bytes(), flip))
    return "graph", end_of(["graph", str(path)], folder)


if __name__ == "__main__":
    main()
