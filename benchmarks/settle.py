"""Rooms simulated for two seconds: what does not rest, what overlaps at the start, which relations go on holding.

    python benchmarks/settle.py DIR [--seeds 200:210] [--kinds bedroom,study] [--report]

Rooms are the samples, a seed each; with walls where the seed is even, with small things where it halves to an even
number. DIR keeps them (`tests/clients` simulate the same rooms in other engines); `--report` only judges those there.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import torch

import echousd
from echomodel.boxes import Boxes
from echousd.graph import SceneGraph
from echousd.make.reading import read_room
from echousd.make.verdicts import relation_verdicts
from echousd.options import RoomOptions
from echousd.settle.settle import SettleReport, settle

SAMPLES = Path(__file__).parents[1] / "samples"
KINDS = "bedroom,living_room,dining_room,study,living_dining"


def broken(graph: SceneGraph, boxes: Boxes) -> set[str]:
    """Triples of the relations that do not hold."""
    return {f"{v.subject} {v.predicate} {v.object}" for v in relation_verdicts(graph, boxes) if v.state == "broken"}


def at_rest(graph: SceneGraph, boxes: Boxes, report: SettleReport) -> Boxes:
    """The boxes where the pieces are after two seconds."""
    position, yaw = np.array(boxes.position.tolist()), np.array(boxes.yaw.tolist())
    for motion in report.motions:
        if motion.path.startswith("/Room/Objects/"):
            row = graph.names.index(motion.name)
            position[row], yaw[row] = motion.place[:3, 3], np.arctan2(motion.place[0, 2], motion.place[2, 2])
    return Boxes(boxes.size, *(torch.as_tensor(v, dtype=torch.float32) for v in (position, yaw)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", default="200:210")
    parser.add_argument("--kinds", default=KINDS)
    parser.add_argument("--report", action="store_true")
    options = parser.parse_args()
    low, high = map(int, options.seeds.split(":"))
    rooms = pieces = restless = bad = before = after = relations = 0
    for seed in range(low, high):
        for kind in options.kinds.split(","):
            root = options.folder / f"{kind}_{seed}" / f"{kind}_{seed}.usda"
            started = time.perf_counter()
            if not options.report and not root.is_file():
                how = RoomOptions(walls=seed % 2 == 0, dress="some" if seed % 4 < 2 else "none")
                echousd.generate(SAMPLES / f"{kind}.usda", seed=seed, options=how).save(root.parent, preview=False)
            if not root.is_file():
                continue
            room, report = read_room(root), settle(root)
            was, now = broken(room.graph, room.boxes), broken(room.graph, at_rest(room.graph, room.boxes, report))
            rooms, pieces, restless = rooms + 1, pieces + len(report.motions), restless + len(report.restless)
            bad, before, after = bad + (not report.ok), before + len(was), after + len(now)
            relations += len(room.graph.relations)
            most = max(report.motions, key=lambda motion: motion.shift)
            spent = time.perf_counter() - started
            print(f"{root.stem}: {len(report.motions)} pieces, at most {most.shift:.4f} m, {spent:.0f} s", flush=True)
            for motion in report.restless:
                print(f"    {motion.name} {motion.shift:.3f} m {motion.turn:.1f} degrees: it {motion.why}", flush=True)
            for told in sorted(was ^ now):
                print(f"    {told} {'held, does not' if told in now else 'did not hold, does'} at rest", flush=True)
    print(f"{rooms} rooms, {pieces} pieces: {restless} do not rest, in {bad} rooms")
    print(f"{relations} relations: {before} broken as written, {after} at rest")


if __name__ == "__main__":
    main()
