"""A plan as a house of ProcTHOR 1.0.0: rooms, walls, doors and windows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from echomodel.files import write_json
from echomodel.openings import direction, segment
from echousd.home.openings import Floor, counterpart
from echousd.home.plan import Plan, ways

HEIGHT = 2.7  # metres of a room that says nothing of it
KINDS = {"kitchen": "Kitchen", "bathroom": "Bathroom", "bedroom": "Bedroom", "childrens_room": "Bedroom"}
LOOK = {"name": "PureWhite"}
ASSETS = {"door": "Doorway_1", "passage": "Doorframe_1", "window": "Window_Slider_48x36"}


def write_procthor(plan: Plan, path: Path) -> None:
    """Write the rooms, walls, doors and windows of a plan; furniture stays out, whose models AI2-THOR does not have.

    Walls of ProcTHOR have no thickness: rooms end in the middle of the walls between them.
    """
    number = {name: index + 2 for index, name in enumerate(plan.cells)}  # 1 is outside
    floors = {name: Floor(name, floor, plan.walls[name]) for name, floor in plan.floors.items()}
    rooms, walls = [], []
    for name, cell in plan.cells.items():
        spec = plan.home.room(name).graph.room
        corners = [{"x": z, "y": 0, "z": x} for x, z in cell.round(4).tolist()]  # Unity's x is our east
        about = {"roomType": KINDS.get(spec.type, "LivingRoom"), "floorPolygon": corners, "floorMaterial": LOOK}
        rooms.append({"id": f"room|{number[name]}", **about, "ceilings": [], "children": []})
        for edge, ends in enumerate(zip(corners, [*corners[1:], corners[0]], strict=True)):
            polygon = [*ends, *({**corner, "y": spec.height or HEIGHT} for corner in ends)]
            mine = {"id": f"wall|{number[name]}|{edge}", "roomId": f"room|{number[name]}"}
            walls.append({**mine, "material": LOOK, "polygon": polygon})
    found: dict[str, Any] = {"rooms": rooms, "walls": walls, "doors": [], "windows": [], "objects": []}
    inner = [(one, opening) for (one, _), opening in ways(plan)]
    outer = [
        (name, opening)
        for name, floor in floors.items()
        for opening in plan.openings[name]
        if counterpart(floor, opening, floors.values()) is None
    ]
    for name, opening in (*inner, *outer):
        behind = counterpart(floors[name], opening, floors.values())
        wall, room = f"wall|{number[name]}|{opening.edge}", f"room|{number[name]}"
        there = (f"wall|{number[behind[0]]}|{behind[1].edge}", f"room|{number[behind[0]]}") if behind else (wall, room)
        cell = plan.cells[name]
        at = (segment(plan.floors[name], opening) - cell[opening.edge]) @ direction(cell, opening.edge)
        low, high = {"y": opening.sill}, {"y": opening.sill + opening.height}
        kind = "window" if opening.kind == "window" else "door"
        one = {"id": f"{kind}|{number[name]}|{len(found[f'{kind}s'])}", "assetId": ASSETS[opening.kind]}
        one |= {"room0": room, "room1": there[1], "wall0": wall, "wall1": there[0]}
        middle = {"x": float(at.mean()), "y": opening.sill + opening.height / 2, "z": 0}
        hole = [{"x": float(np.round(x, 4)), **y, "z": 0} for x, y in zip(at, (low, high), strict=True)]
        found[f"{kind}s"].append({**one, "holePolygon": hole, "assetPosition": middle})
    found["proceduralParameters"] = {"ceilingMaterial": LOOK, "floorColliderThickness": 1.0, "lights": []}
    found["metadata"] = {"schema": "1.0.0", "generator": "echousd"}
    write_json(path, found)
