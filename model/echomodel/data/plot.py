"""Top-down pictures of rooms: oriented rectangles coloured per coarse class, a tick at each front, labels."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echomodel.files import whole_file
from echomodel.openings import segment, swing_area
from echomodel.roomboxes import RoomBoxes, footprints
from echomodel.vocabulary import vocabulary

CELL = 2.8  # inches
HANGING = 0.8  # metres; what hangs higher is drawn lightly


def plot_rooms(
    rooms: Sequence[RoomBoxes], path: str | os.PathLike[str], *, columns: int = 8, labels: bool = True, dpi: int = 80
) -> None:
    """Draw rooms beside one another, +X to the right and +Z down (an observer who faces +X has left above).

    Arguments:
        rooms: at least one.
        path: picture file (.png, .pdf, .svg).
        columns: rooms in a row. labels: write the categories. dpi: resolution.

    Raises:
        ValueError: no rooms.
    """
    if not rooms:
        raise ValueError("no rooms to plot")
    from matplotlib import colormaps
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(columns, len(rooms))
    lines = -(-len(rooms) // columns)
    figure = Figure(figsize=(columns * CELL, lines * CELL))
    FigureCanvasAgg(figure)
    palette, words = colormaps["tab20"], vocabulary().coarse_categories
    for k, room in enumerate(rooms):
        axes = figure.add_subplot(lines, columns, k + 1)
        axes.set_axis_off()
        axes.set_aspect("equal")
        if len(room.floor_polygon):
            axes.fill(*room.floor_polygon.T, facecolor="whitesmoke", edgecolor="black", linewidth=1.2)
        for opening in room.openings:
            shade = {"door": "saddlebrown", "window": "deepskyblue", "passage": "white"}[opening.kind]
            axes.plot(*segment(room.floor_polygon, opening).T, color=shade, linewidth=3)
            if len(swing := swing_area(room.floor_polygon, opening)):
                axes.plot(*np.vstack([swing, swing[:1]]).T, color=shade, linewidth=0.6)
        corners = footprints(room.size, room.position, room.yaw)
        for i in np.argsort(room.position[:, 1] if len(room) else []):
            coarse = _coarse(room.categories[i])
            colour = palette(words.index(coarse) % 20) if coarse else "grey"
            high = room.position[i, 1] > HANGING
            axes.fill(
                *corners[i].T, facecolor=colour, alpha=0.3 if high else 0.7, edgecolor="black", linewidth=0.5,
                linestyle=":" if high else "-",
            )  # fmt: skip
            x, z = room.position[i, [0, 2]]
            reach = room.size[i, 2] / 2
            axes.plot([x, x + np.sin(room.yaw[i]) * reach], [z, z + np.cos(room.yaw[i]) * reach], "r-", linewidth=0.7)
            if labels:
                axes.text(x, z, room.categories[i].replace("_", "\n"), fontsize=3.5, ha="center", va="center")
        axes.invert_yaxis()
        axes.set_title(f"{room.id} ({room.room_type})", fontsize=5, pad=1)
    figure.subplots_adjust(0.005, 0.005, 0.995, 0.98, 0.03, 0.08)
    with whole_file(path, Path(path).suffix) as beside:
        figure.savefig(beside, dpi=dpi)


def _coarse(word: str) -> str | None:
    row = vocabulary().known_category(word)
    return None if row is None else row.coarse
