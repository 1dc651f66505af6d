"""Unselected rooms from above, on sheets: what a person would point at, counted by the living rules and by eye.

    python benchmarks/room_sheets.py --seeds 4 -o sheets
    python benchmarks/room_sheets.py --set people --seeds 2 -o sheets
    python benchmarks/room_sheets.py --set people more --lot 24 --draw 7 -o sheets

The five samples (`samples`), what `echousd new --room` writes for all five types (`new`), and graphs as people write
them (`people`, `more`: people_graphs.yaml, more_graphs.yaml), each with the same seeds; boxes with their front as a
dark edge, faults of the rules in red. `--lot` draws graphs and seeds at random (`--draw` from which) and makes them as
`generate` does, with parts and small things: from above, from inside, and below what `check` says.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml
from PIL import Image, ImageDraw, ImageFont

from echomodel.boxes2d import footprints
from echomodel.openings import segment, swing_area
from echomodel.vocabulary import vocabulary
from echousd import check, generate
from echousd.draw.rendering import render_stage
from echousd.graph import SceneGraph, load_graph, starting_graph
from echousd.make.finished import Room
from echousd.place.living import living_faults

TYPES = ("bedroom", "living_room", "dining_room", "living_dining_room", "study")
SETS = ("samples", "new", "people", "more")
CELL, TITLE, LINES = 540, 34, 66  # pixels
ACROSS, DOWN = 3, 2  # rooms on a sheet
FONT = ImageFont.load_default(13)


def cell(room: Room, title: str) -> tuple[Image.Image, list[str]]:
    """One room from above, and its faults as sentences."""
    faults = [f"{fault.rule}: {fault.says}" for fault in living_faults(room.graph, room.boxes, room.floor)]
    picture = Image.new("RGB", (CELL, CELL + TITLE + LINES), "white")
    draw = ImageDraw.Draw(picture)
    low, high = room.floor.min(0), room.floor.max(0)
    scale = (CELL - 40) / float((high - low).max())

    def at(points: np.ndarray) -> list[tuple[float, float]]:
        x, z = np.asarray(points).T  # the front is up, as on plans
        return list(zip((z - low[1]) * scale + 20, (high[0] - x) * scale + 20 + TITLE, strict=True))

    draw.polygon(at(room.floor), fill="#f7f5f2", outline="black", width=3)
    outline = room.floor if room.graph.room.corners is None else np.asarray(room.graph.room.corners)
    for opening in room.graph.room.openings:
        colour = "#4a90d9" if opening.kind == "window" else "#b07030"
        draw.line(at(segment(outline, opening)), fill=colour, width=9)
        if len(sweep := swing_area(outline, opening)):
            draw.polygon(at(sweep), outline=colour)
    size, position, yaw = (np.asarray(v, float) for v in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    plan = footprints(size, position, yaw)
    for i in np.argsort(position[:, 1] + 0.01 * size[:, 1]):
        kind = vocabulary().category(room.graph.nodes[i].category)
        points = at(plan[i])
        hangs = kind.support == "ceiling"
        draw.polygon(points, fill=None if hangs else kind.colour, outline="#d0a000" if hangs else "#444444")
        if not hangs:
            draw.line([points[2], points[3]], fill="black", width=5)
        middle = np.mean(points, 0)
        draw.text(tuple(middle), room.names[i][:14], fill="#a08000" if hangs else "black", anchor="mm", font=FONT)
    broken = sum(v.state == "broken" for v in room.verdicts)
    said = f"{title}  {high[0] - low[0]:.1f} x {high[1] - low[1]:.1f} m, broken {broken}"
    draw.text((8, 6), said, fill="black", font=FONT)
    for number, text in enumerate(faults[:4]):
        draw.text((8, CELL + TITLE + 16 * number), text[:80], fill="red", font=FONT)
    return picture, faults


def seen(room: Room, picture: Image.Image) -> tuple[Image.Image, list[str]]:
    """The room from above and, at its right, from inside, with what `check` says of its stage."""
    report = check(room.stage)
    said = [f"{fault.rule}: {fault.says}" for layout in report.layouts for fault in layout.living]
    said += [f"relation: {one}" for layout in report.layouts for one in layout.broken]
    said += [f"placement: {one}" for one in report.placement] + [f"collision: {one}" for one in report.collisions]
    out = Image.new("RGB", (2 * CELL, picture.height), "white")
    out.paste(picture.crop((0, 0, CELL, CELL + TITLE)), (0, 0))
    inside = render_stage(room.stage, view="dollhouse", size=CELL, rays=1)
    out.paste(inside, (CELL, TITLE + (CELL - inside.height) // 2))
    for number, text in enumerate(said[:4]):
        ImageDraw.Draw(out).text((8, CELL + TITLE + 16 * number), text[:150], fill="red", font=FONT)
    return out, said


def drawn_by_lot(graphs: list[tuple[str, SceneGraph]], count: int, draw: int) -> list[tuple[str, SceneGraph, int]]:
    """Graphs, each once while there are any left, and a seed for each."""
    luck = np.random.default_rng(draw)
    order = np.concatenate([luck.permutation(len(graphs)) for _ in range(-(-count // len(graphs)))])[:count]
    return [(*graphs[number], int(luck.integers(10_000, 1_000_000))) for number in order]


def graphs_of(sets: list[str]) -> Iterator[tuple[str, SceneGraph]]:
    """Name and graph of every room of some of `SETS`."""
    here = Path(__file__).parent
    if "samples" in sets:
        for path in sorted(here.parent.glob("samples/*.yaml")):
            yield path.stem, load_graph(path)
    if "new" in sets:
        for word in TYPES:
            yield f"new_{word}", starting_graph(word)
    for word in ("people", "more"):
        if word in sets:
            for name, entry in yaml.safe_load((here / f"{word}_graphs.yaml").read_text("utf-8")).items():
                yield name, SceneGraph.from_yaml(yaml.safe_dump(entry, sort_keys=False))


def save_sheets(cells: list[Image.Image], folder: Path) -> None:
    """The pictures in their order on as many sheets as they need."""
    across, down = (ACROSS, DOWN) if cells[0].width == CELL else (2, 2)
    for first in range(0, len(cells), across * down):
        sheet = Image.new("RGB", (across * cells[0].width, down * cells[0].height), "white")
        for number, picture in enumerate(cells[first : first + across * down]):
            sheet.paste(picture, ((number % across) * picture.width, (number // across) * picture.height))
        sheet.save(folder / f"sheet_{first // (across * down):02d}.png")


def main() -> None:
    """Draw the sheets and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--set", nargs="*", default=list(SETS), choices=SETS)
    parser.add_argument("--only", nargs="*", default=None, help="names of samples, new_TYPE or rooms of people")
    parser.add_argument("--lot", type=int, default=0, help="so many graphs and seeds by lot, made in full")
    parser.add_argument("--draw", type=int, default=0, help="seed of the lot")
    parser.add_argument("-o", "--output", type=Path, default=Path("sheets"))
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    options.output.mkdir(parents=True, exist_ok=True)
    cells, took = [], []
    clean = faults = objects = broken = collisions = 0
    by_rule: Counter[str] = Counter()
    graphs = [(name, graph) for name, graph in graphs_of(options.set) if not options.only or name in options.only]
    rows = [(*of, seed) for of in graphs for seed in range(options.first, options.first + options.seeds)]
    for name, graph, seed in drawn_by_lot(graphs, options.lot, options.draw) if options.lot else rows:
        started = time.perf_counter()
        room = generate(graph, seed=seed, shapes="parts" if options.lot else "boxes")
        took.append(room.timings["layout"] + room.timings["place"])
        picture, found = cell(room, f"{name} seed {seed}  {time.perf_counter() - started:.1f} s")
        if options.lot:
            picture, found = seen(room, picture)
        cells.append(picture)
        clean, faults, objects = clean + (not found), faults + len(found), objects + len(room.names)
        broken += sum(v.state == "broken" for v in room.verdicts)
        collisions += len(room.faults) - sum(v.state == "broken" for v in room.verdicts)
        by_rule.update(sentence.partition(":")[0] for sentence in found)
        for sentence in found:
            print(f"{name} {seed}: {sentence}", flush=True)
    save_sheets(cells, options.output)
    print(
        f"{len(cells)} rooms, {clean} without a fault, {faults} faults at {objects} objects, {broken} relations broken,"
    )
    print(f"{collisions} other faults; {', '.join(f'{rule} {count}' for rule, count in by_rule.most_common())}")
    print(f"layout and placing {np.mean(took):.2f} s a room, {np.quantile(took, 0.95):.2f} s in 95 of 100")


if __name__ == "__main__":
    main()
