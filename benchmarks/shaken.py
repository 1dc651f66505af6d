"""Noisy rooms placed: relations kept, pairs colliding, time per room.

    python benchmarks/shaken.py ROOMS.json [--noise 0.1 0.2 0.4] [--drop 0.5] [--limit N] [--rules strict] [--seed 0]

ROOMS.json is any rooms file (`echousd data build`, or one of your own in the same form). Every room is labelled by the
rules as it is, then its boxes get Gaussian noise (metres on positions, 10 % on sizes, 3 degrees on yaw) and are
placed. `clean` is the labelled room itself, by the same measures. Times are CPU times on one core.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import replace

import numpy as np
import torch

from echomodel.boxes import Boxes
from echomodel.roomboxes import RoomBoxes, read_rooms
from echomodel.rules import label_relations, margins
from echomodel.vocabulary import vocabulary
from echousd.place.geometry import separation
from echousd.place.placing import place_boxes


def noisy(room: RoomBoxes, noise: float, rng: np.random.Generator) -> RoomBoxes:
    """The room with Gaussian noise on positions (metres; heights a third of it), sizes (10 %) and yaw (3 degrees)."""
    position = room.position + rng.normal(0, noise, room.position.shape) * (1, 1 / 3, 1)
    size = room.size * np.exp(rng.normal(0, 0.1, room.size.shape))
    return replace(room, position=position, size=size, yaw=room.yaw + rng.normal(0, np.radians(3), len(room)))


def centred(room: RoomBoxes) -> RoomBoxes:
    """The room with the middle of its floor at the origin and no side shorter than 2 cm."""
    middle = (room.floor_polygon.max(0) + room.floor_polygon.min(0)) / 2
    position = room.position - np.array([middle[0], 0.0, middle[1]])
    return replace(room, position=position, floor_polygon=room.floor_polygon - middle, size=np.maximum(room.size, 0.02))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms")
    parser.add_argument("--noise", type=float, nargs="+", default=[0.1, 0.2, 0.4])
    parser.add_argument("--drop", type=float, default=0.5)
    parser.add_argument("--limit", type=int)
    parser.add_argument("--rules", default="strict")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    rooms = [centred(room) for room in read_rooms(arguments.rooms) if len(room) > 1][: arguments.limit]
    for noise in arguments.noise:
        report(rooms, noise, arguments)


def report(rooms: list[RoomBoxes], noise: float, arguments: argparse.Namespace) -> None:
    """Print one line for one level of noise."""
    rng = np.random.default_rng(arguments.seed)
    kept = measured = before = pairs = hit = clean_hit = outside = objects = 0
    seconds, bare, moved, edges, broken = [], [], [], [], Counter[str]()
    for room in rooms:
        triplets = label_relations(room, rules=arguments.rules, drop=arguments.drop, rng=rng)
        start = noisy(room, noise, rng)
        begun = time.process_time()
        done = place_boxes(
            room.categories, start.size, start.position, start.yaw, triplets,
            floor_polygon=room.floor_polygon, height=room.height, rules=arguments.rules,
        )  # fmt: skip
        seconds.append(time.process_time() - begun)
        clean = collisions_of(room)
        judged = done.verdict >= 0
        begun = time.process_time()
        tensors = (torch.as_tensor(v, dtype=torch.float32) for v in (start.size, start.position, start.yaw))
        margin = margins(Boxes(*tensors), torch.as_tensor(triplets), rules=arguments.rules)
        bare.append(time.process_time() - begun)
        before += int((margin.numpy()[judged] >= 0).sum())
        kept, measured = kept + int((done.verdict == 1).sum()), measured + int(judged.sum())
        broken.update(vocabulary().predicates[p].name for p in triplets[done.verdict == 0, 1])
        n = len(room)
        pairs, hit, clean_hit = pairs + n * (n - 1) // 2, hit + len(done.collisions), clean_hit + clean
        outside, objects = outside + len(done.outside), objects + n
        moved.append(np.linalg.norm(done.position - start.position, axis=1).mean())
        edges.append(len(triplets))
    print(
        f"noise {noise:.2f} m: relations kept {before / measured:.4f} -> {kept / measured:.4f} of {measured}, "
        f"pairs colliding {hit / pairs:.5f} (clean rooms {clean_hit / pairs:.5f}) of {pairs}, "
        f"objects outside {outside / objects:.4f} of {objects}; mean move {np.mean(moved):.3f} m; "
        f"{np.mean(edges):.0f} relations and {objects / len(rooms):.1f} objects a room; "
        f"seconds mean {np.mean(seconds):.3f} median {np.median(seconds):.3f} "
        f"p95 {np.percentile(seconds, 95):.3f} max {max(seconds):.3f} "
        f"= {np.median(np.array(seconds) / np.array(bare)):.0f} x one bare margin evaluation; broken {dict(broken)}"
    )


def collisions_of(room: RoomBoxes) -> int:
    """Pairs that collide in a room as it is, by placing's own measure."""
    from echomodel.objective.support import allowed_overlap
    from echousd.place.geometry import TOUCH
    from echousd.place.problem import problem_of

    none = np.zeros(len(room), bool)
    problem = problem_of(
        room.categories, room.size, room.position, room.yaw, np.zeros((0, 3), int),
        floor_polygon=None, height=None, fixed=none, rigid=none, turned=none,
    )  # fmt: skip
    allowed = allowed_overlap(problem.categories, room.size, problem.pairs)
    return int((separation(room.size, room.position, room.yaw, problem.pairs) + allowed < -TOUCH).sum())


if __name__ == "__main__":
    main()
