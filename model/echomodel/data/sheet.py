"""Small shaded pictures of meshes, drawn point by point, and plans of rooms beside one another."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from echomodel.boxes2d import footprints
from echomodel.files import whole_file
from echomodel.openings import segment, swing_area
from echomodel.roomboxes import RoomBoxes
from echomodel.vocabulary import vocabulary

PLAIN = np.array([176.0, 172.0, 166.0])
YAW, PITCH = 0.6, 0.35  # radians, from where meshes are seen; 0, 0 looks at the front (+Z) face


def thumbnail(mesh: trimesh.Trimesh, pixels: int, colours: np.ndarray = PLAIN) -> Image.Image:
    """Shaded orthographic picture of a mesh, seen from its front right above.

    Arguments:
        mesh: triangles in the object frame. pixels: side of the picture.
        colours: (3,) or (f, 3) sRGB of 0 to 255, of all or of each triangle.
    """
    side = pixels * 2  # drawn larger, then averaged down
    points, face = trimesh.sample.sample_surface(mesh, 4 * side * side, seed=0)
    toward = np.array([np.sin(YAW) * np.cos(PITCH), np.sin(PITCH), np.cos(YAW) * np.cos(PITCH)])
    right = np.array([np.cos(YAW), 0, -np.sin(YAW)])
    view = np.stack([right, np.cross(toward, right), toward])
    seen, corners = points @ view.T, np.asarray(mesh.vertices, float) @ view.T
    low, high = corners.min(0), corners.max(0)
    size = max(high[0] - low[0], high[1] - low[1], 1e-9)
    x, y = ((seen - (low + high) / 2) / size * (0.9 * side) * [1, -1, 1] + side / 2).astype(int).T[:2]
    normal = mesh.face_normals @ view.T
    normal[normal[:, 2] < 0] *= -1
    light = np.maximum(normal @ (np.array([-0.35, 0.75, 0.6]) / np.linalg.norm([-0.35, 0.75, 0.6])), 0)
    shaded = colours * (0.4 + 0.65 * light[:, None])
    picture = np.full((side, side, 3), 250.0)
    order = np.argsort(seen[:, 2])[:, None]  # what is nearer is drawn later, each point two pixels wide
    picture[y[order] + [0, 1, 0, 1], x[order] + [0, 0, 1, 1]] = shaded[face[order]]
    return Image.fromarray(picture.clip(0, 255).astype(np.uint8)).resize((pixels, pixels), Image.Resampling.BOX)


CELL = 2.8  # inches
HANGING = 0.8  # metres; what hangs higher is drawn lightly


def plot_rooms(
    rooms: Sequence[RoomBoxes], path: str | os.PathLike[str], *, columns: int = 8, labels: bool = True
) -> None:
    """Draw rooms beside one another, +X to the right and +Z down (an observer who faces +X has left above).

    Arguments:
        rooms: at least one.
        path: picture file (.png, .pdf, .svg).
        columns: rooms in a row. labels: write the categories.

    Raises ValueError for no rooms.
    """
    if not rooms:
        raise ValueError("no rooms to plot")
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    columns = min(columns, len(rooms))
    lines = -(-len(rooms) // columns)
    figure = Figure(figsize=(columns * CELL, lines * CELL))
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
            row = vocabulary().known_category(room.categories[i])
            colour = "grey" if row is None else palette(words.index(row.coarse) % 20)
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
        figure.savefig(beside, dpi=80)
