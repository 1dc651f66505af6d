"""Placing measured: told relations kept, terms missed, CPU seconds; the same drafts by several ways, room by room.

    python benchmarks/placing.py [--rooms ROOMS.json] [--count 30] [--off TERM ...] [--sheet sheets] [--cache FOLDER]
    python benchmarks/placing.py --each

Rooms of the room generator from a seed that no training used, or every so many of a rooms file, with one near relation
an object told. Each is drawn once by the network (kept in the cache), then placed. Faults are those of all terms of the
objective, and that all can be walked to; times are CPU times of one thread. `--off` leaves terms out of the search and
tells what the others find then; `--each` does so for each term in turn, as the rows of a table.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from pathlib import Path

import numpy as np
import torch
from PIL import Image, ImageDraw, ImageFont

from echomodel.boxes2d import footprints
from echomodel.data.roomset import load_rooms, with_known_words
from echomodel.metrics.layouts import Task, tasks_of
from echomodel.objective import KINDS, TERMS, faults_of, plan_of, unreached
from echomodel.openings import segment
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echomodel.vocabulary import vocabulary
from echousd.evaluation.systems import BASES
from echousd.place.placing import place_boxes
from echousd.place.solver import PlaceConfig

SEED = 770_000  # of the generated rooms
CELL = 420  # pixels


def drawn(tasks: list[Task], cache: Path) -> list[tuple[np.ndarray, ...]]:
    """Size, position and yaw of a draft of every room, from the cache or drawn by the network."""
    if not cache.exists():
        out = []
        for room in BASES["network"][0](tasks, 0):
            middle = np.insert((room.floor_polygon.max(0) + room.floor_polygon.min(0)) / 2, 1, 0.0)
            out.append([value.tolist() for value in (room.size, room.position - middle, room.yaw)])
        cache.parent.mkdir(parents=True, exist_ok=True)
        cache.write_text(json.dumps(out))
    return [tuple(np.array(value) for value in row) for row in json.loads(cache.read_text())]


def centred(room: RoomBoxes) -> np.ndarray:
    """The corners of a room's floor about the middle of its bounding box, as the network draws."""
    return room.floor_polygon - (room.floor_polygon.max(0) + room.floor_polygon.min(0)) / 2


def picture(room: RoomBoxes, floor: np.ndarray, boxes: tuple[np.ndarray, ...], said: list[str]) -> Image.Image:
    """A placed room from above, with its faults."""
    size, position, yaw = boxes
    image = Image.new("RGB", (CELL, CELL + 70), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(11)
    low, high = floor.min(0), floor.max(0)
    scale = (CELL - 20) / float((high - low).max())

    def at(points: np.ndarray) -> list[tuple[float, ...]]:
        return [tuple(p) for p in ((points - low) * scale + 10).tolist()]

    draw.polygon(at(floor), fill="#f7f5f2", outline="black", width=2)
    for opening in room.openings:
        draw.line(at(segment(floor, opening)), fill="#4a90d9" if opening.kind == "window" else "#b07030", width=7)
    plan = footprints(size, position, yaw)
    for i in np.argsort(position[:, 1] + 0.01 * size[:, 1]):
        kind = vocabulary().category(room.categories[i])
        points, hangs = at(plan[i]), kind.support == "ceiling"
        draw.polygon(points, fill=None if hangs else kind.colour, outline="#d0a000" if hangs else "#444444")
        if not hangs:
            draw.line([points[2], points[3]], fill="black", width=4)
            draw.text(tuple(np.mean(points, 0)), f"{kind.name[:13]} {i}", fill="black", anchor="mm", font=font)
    for number, text in enumerate(said[:4]):
        draw.text((6, CELL + 2 + 16 * number), text[:70], fill="red", font=font)
    return image


def placed(
    room: RoomBoxes, draft: tuple[np.ndarray, ...], told: np.ndarray, config: PlaceConfig | None
) -> tuple[tuple[np.ndarray, ...], list[str], int, float]:
    """Boxes, faults as `term: sentence`, relations kept and CPU seconds of one draft placed; no config = as drawn."""
    floor, begun = centred(room), time.process_time()
    size, position, yaw = draft
    if config is not None:
        done = place_boxes(
            room.categories, size, position, yaw, told, floor_polygon=floor, height=room.height,
            openings=room.openings, config=config,
        )  # fmt: skip
        size, position, yaw = done.size, done.position, done.yaw
    seconds = time.process_time() - begun
    boxes = type("Boxes", (), {"size": size, "position": position, "yaw": yaw})
    plan = plan_of(boxes, room.categories, floor, room.openings, told, height=room.height)
    names = [f"{word} {number}" for number, word in enumerate(room.categories)]
    seen = faults_of(plan, KINDS) + unreached(plan)
    kept = len(told) - sum(fault.rule in {row.name for row in vocabulary().predicates} for fault in seen)
    return (size, position, yaw), [f"{fault.rule}: {fault.sentence(names)}" for fault in seen], kept, seconds


def without_each(rooms: list[RoomBoxes], drafts: list[tuple[np.ndarray, ...]], told: list[np.ndarray]) -> None:
    """Print for each term what a search without it leaves of itself and of all others, beside one with all terms."""

    def found(off: str) -> tuple[Counter[str], int]:
        config = PlaceConfig(without=frozenset({off} - {""}))
        said = [placed(*each, config)[1] for each in zip(rooms, drafts, told, strict=True)]
        return Counter(one.partition(":")[0] for room in said for one in room), sum(not room for room in said)

    usual, clean = found("")
    print(f"all terms: {usual.total()} faults, {clean} of {len(rooms)} rooms without any")
    for term in [term.name for term in TERMS if term.kind != "relations"]:
        left, free = found(term)
        others, before = left.total() - left[term], usual.total() - usual[term]
        print(f"| {term} | {usual[term]} -> {left[term]} | {before} -> {others} | {clean} -> {free} |", flush=True)


def main() -> None:
    """Print one line for each way, and what it misses."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=Path)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--cache", type=Path, default=Path("/tmp/placing"))
    parser.add_argument("--sheet", type=Path)
    parser.add_argument("--ways", nargs="+", default=["drawn", "placed"])
    parser.add_argument("--only", type=int, nargs="*")
    parser.add_argument("--each", action="store_true")
    parser.add_argument("--off", nargs="*", default=[], help="terms that the search does without")
    options = parser.parse_args()
    torch.set_num_threads(1)
    every = generate_rooms(options.count, SEED) if options.rooms is None else load_rooms(options.rooms)
    rooms = [room for room in with_known_words(every) if len(room) > 1]
    rooms = [rooms[number * len(rooms) // options.count] for number in range(min(options.count, len(rooms)))]
    tasks = tasks_of(rooms, 0, stated=1.0)
    told = [task.stated for task in tasks]
    name = "generated" if options.rooms is None else options.rooms.stem
    drafts = drawn(tasks, options.cache / f"{name}_{options.count}.json")
    if options.each:
        without_each(rooms, drafts, told)
        return
    ways = {"drawn": None, "placed": PlaceConfig(without=frozenset(options.off))}
    objects = sum(len(room) for room in rooms)
    for way in options.ways:
        found, pictures, seconds, kept, free = Counter[str](), [], [], 0, 0
        for number, (room, draft, edges) in enumerate(zip(rooms, drafts, told, strict=True)):
            if options.only and number not in options.only:
                continue
            boxes, said, held, took = placed(room, draft, edges, ways[way])
            found.update(one.partition(":")[0] for one in said)
            seconds, kept, free = [*seconds, took], kept + held, free + (not said)
            if options.sheet:
                pictures.append(picture(room, centred(room), boxes, [f"{number} {room.room_type} {len(room)}", *said]))
            if options.only:
                print(number, room.room_type, len(room), round(took, 2), *said, sep="\n  ")
        print(
            f"{way}: {len(rooms)} rooms, {objects} objects, told kept {kept / sum(map(len, told)):.4f}, "
            f"{sum(found.values()) / objects:.4f} faults an object, {free / len(rooms):.2f} without any; "
            f"CPU s mean {np.mean(seconds):.2f} median {np.median(seconds):.2f} max {max(seconds):.2f}\n  "
            + ", ".join(f"{term} {count}" for term, count in found.most_common())
        )
        for first in range(0, len(pictures), 12):
            sheet = Image.new("RGB", (4 * CELL, 3 * pictures[0].height), "white")
            for at, one in enumerate(pictures[first : first + 12]):
                sheet.paste(one, ((at % 4) * CELL, (at // 4) * one.height))
            options.sheet.mkdir(parents=True, exist_ok=True)
            sheet.save(options.sheet / f"{name}_{way}_{first // 12:02d}.png")


if __name__ == "__main__":
    main()
