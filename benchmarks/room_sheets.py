"""Unselected rooms from above, on one sheet: what a person would point at, counted by the living rules and by eye.

    python benchmarks/room_sheets.py --seeds 4 -o sheets

The five samples and what `echousd new --room` writes for all five types, each with the same seeds; boxes with their
front as a dark edge, faults of the rules in red.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from echomodel.openings import segment, swing_area
from echomodel.vocabulary import vocabulary
from echousd import generate
from echousd.graph import load_graph
from echousd.graph.starting import starting_graph
from echousd.repair.geometry import corners
from echousd.repair.living import living_faults

TYPES = ("bedroom", "living_room", "dining_room", "living_dining_room", "study")
CELL, TITLE, LINES = 420, 30, 60  # pixels


def cell(room, title: str) -> tuple[Image.Image, list[str]]:  # type: ignore[no-untyped-def]
    """One room from above, and its faults as sentences."""
    faults = [fault.says for fault in living_faults(room.graph, room.boxes, room.floor)]
    picture = Image.new("RGB", (CELL, CELL + TITLE + LINES), "white")
    draw = ImageDraw.Draw(picture)
    low, high = room.floor.min(0), room.floor.max(0)
    scale = (CELL - 40) / float((high - low).max())

    def at(points: np.ndarray) -> list[tuple[float, float]]:
        return [tuple(p) for p in ((np.asarray(points) - low) * scale + (20, 20 + TITLE)).tolist()]

    draw.polygon(at(room.floor), fill="#f7f5f2", outline="black", width=3)
    outline = room.floor if room.graph.room.corners is None else np.asarray(room.graph.room.corners)
    for opening in room.graph.room.openings:
        colour = "#4a90d9" if opening.kind == "window" else "#b07030"
        draw.line(at(segment(outline, opening)), fill=colour, width=7)
        if len(sweep := swing_area(outline, opening)):
            draw.polygon(at(sweep), outline=colour)
    size, position, yaw = (np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    plan = corners(size, position, yaw)
    for i in np.argsort(position[:, 1] + 0.01 * size[:, 1]):
        kind = vocabulary().category(room.graph.nodes[i].category)
        points = at(plan[i])
        hangs = kind.support == "ceiling"
        draw.polygon(points, fill=None if hangs else kind.colour, outline="#d0a000" if hangs else "#444444")
        if not hangs:
            draw.line([points[2], points[3]], fill="black", width=4)
        middle = np.mean(points, 0)
        draw.text(tuple(middle - (18, 5)), room.names[i][:14], fill="#a08000" if hangs else "black")
    broken = sum(v.state == "broken" for v in room.verdicts)
    draw.text((8, 6), f"{title}  {high[0] - low[0]:.1f} x {high[1] - low[1]:.1f} m, broken {broken}", fill="black")
    for number, text in enumerate(faults[:4]):
        draw.text((8, CELL + TITLE + 13 * number), text[:70], fill="red")
    return picture, faults


def main() -> None:
    """Draw the sheets and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=None, help="names of samples or new_TYPE")
    parser.add_argument("-o", "--output", type=Path, default=Path("sheets"))
    options = parser.parse_args()
    graphs = {f"new_{word}": starting_graph(word) for word in TYPES}
    for path in sorted(Path(__file__).parents[1].glob("samples/*.yaml")):
        graphs[path.stem] = load_graph(path)
    options.output.mkdir(parents=True, exist_ok=True)
    rooms = clean = faults = objects = broken = 0
    seconds = 0.0
    for name, graph in graphs.items():
        if options.only and name not in options.only:
            continue
        cells = []
        for seed in range(options.first, options.first + options.seeds):
            started = time.perf_counter()
            room = generate(graph, seed=seed, shapes="boxes")
            seconds += room.timings["layout"] + room.timings["repair"]
            picture, found = cell(room, f"{name} seed {seed}  {time.perf_counter() - started:.1f} s")
            cells.append(picture)
            rooms, clean, faults = rooms + 1, clean + (not found), faults + len(found)
            objects += len(room.names)
            broken += sum(v.state == "broken" for v in room.verdicts)
            for sentence in found:
                print(f"{name} {seed}: {sentence}")
        across = min(4, len(cells))
        down = -(-len(cells) // across)
        sheet = Image.new("RGB", (across * CELL, down * cells[0].height), "white")
        for number, picture in enumerate(cells):
            sheet.paste(picture, ((number % across) * CELL, (number // across) * picture.height))
        sheet.save(options.output / f"{name}.png")
    print(f"{rooms} rooms, {clean} without a fault, {faults} faults at {objects} objects, {broken} relations broken,")
    print(f"layout and repair {seconds / rooms:.2f} s a room")


if __name__ == "__main__":
    main()
