"""Makes docs/rules.png: for each term a room from above that breaks it, what is at fault in red.

python docs/make_rule_pictures.py

Rooms are those of the room generator with one change by lot, a piece moved, turned, or changed for another; of those
that break a term the one with fewest other faults is drawn, a small one rather than a large one.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from echomodel.boxes2d import footprints
from echomodel.data.roomset import with_known_words
from echomodel.objective import KINDS, TERMS, WALKED, faults_of, plan_of, unreached
from echomodel.objective.faults import Fault
from echomodel.openings import segment
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms
from echomodel.vocabulary import vocabulary

PICTURE = Path(__file__).with_name("rules.png")
ROOMS, TRIALS, SEED = 260, 60, 5
CELL, COLUMNS = 190, 9  # pixels


def changed(room: RoomBoxes, rng: np.random.Generator) -> RoomBoxes:
    """The room with one piece slid, turned, put anywhere or made of another size."""
    position, yaw, size = room.position.copy(), room.yaw.copy(), room.size.copy()
    one, how = int(rng.integers(len(room))), int(rng.integers(5))
    low, high = room.floor_polygon.min(0), room.floor_polygon.max(0)
    if how == 0:
        position[one, [0, 2]] += rng.normal(0, 0.5, 2)
    elif how == 1:
        yaw[one] += float(rng.choice([np.pi, np.pi / 2, -np.pi / 2, 0.2]))
    elif how == 2:
        position[one, [0, 2]] = rng.uniform(low, high)
    elif how == 3:
        size[one] *= float(rng.choice([0.5, 0.7, 1.4]))
    else:
        position[one, 1] += float(rng.choice([-0.3, 0.3, 1.0]))
    return replace(room, position=position, yaw=yaw, size=size)


def faults(room: RoomBoxes) -> list[Fault]:
    """All that is wrong with a room."""
    nothing = np.zeros((0, 3), int)
    plan = plan_of(room, room.categories, room.floor_polygon, room.openings, nothing, height=room.height)
    return faults_of(plan, KINDS) + unreached(plan)


def drawn(room: RoomBoxes, fault: Fault) -> Image.Image:
    """The room from above: what is at fault red, what it is about orange."""
    image = Image.new("RGB", (CELL, CELL), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(12)
    low, high = room.floor_polygon.min(0), room.floor_polygon.max(0)
    scale = (CELL - 34) / float((high - low).max())

    def at(points: np.ndarray) -> list[tuple[float, ...]]:
        return [tuple(p) for p in ((points - low) * scale + (8, 24)).tolist()]

    draw.text((6, 4), fault.rule, fill="black", font=font)
    draw.polygon(at(room.floor_polygon), fill="#f7f5f2", outline="black", width=2)
    for opening in room.openings:
        colour = "#4a90d9" if opening.kind == "window" else "#b07030"
        draw.line(at(segment(room.floor_polygon, opening)), fill=colour, width=4)
    plan = footprints(room.size, room.position, room.yaw)
    for i in np.argsort(room.position[:, 1] + 0.01 * room.size[:, 1]):
        points, hangs = at(plan[i]), vocabulary().category(room.categories[i]).support == "ceiling"
        fill = {fault.object: "#e05040", fault.other: "#f0b050"}.get(int(i), "#d8d8d8")
        draw.polygon(points, fill=None if hangs and fill == "#d8d8d8" else fill, outline="#666666")
        draw.line([points[2], points[3]], fill="black", width=3)  # its front
    return image


def main() -> None:
    """Look for the rooms and draw them, in the order of the table."""
    rng, best = np.random.default_rng(SEED), dict[str, tuple[float, RoomBoxes, Fault]]()
    for room in with_known_words(generate_rooms(ROOMS, SEED)):
        for trial in range(TRIALS):
            one = room if trial == 0 else changed(room, rng)
            seen = faults(one)
            for fault in seen:
                cost = len(seen) + 0.1 * len(one) + (0.0 if fault.other >= 0 else 0.05)
                if fault.rule not in best or cost < best[fault.rule][0]:
                    best[fault.rule] = (cost, one, fault)
    names = [term.name for term in (*TERMS, *WALKED) if term.kind != "relations"]
    cells = [drawn(*best[name][1:]) for name in names if name in best]
    sheet = Image.new("RGB", (COLUMNS * CELL, -(-len(cells) // COLUMNS) * CELL), "white")
    for number, cell in enumerate(cells):
        sheet.paste(cell, (number % COLUMNS * CELL, number // COLUMNS * CELL))
    sheet.quantize(64).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
