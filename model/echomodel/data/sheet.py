"""Contact sheets: small shaded pictures of meshes in a grid, drawn with a small depth buffer (numpy and pillow)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, ImageDraw

from echomodel.files import whole_file
from echomodel.furniture.assembly import MATERIALS
from echomodel.openings import segment, swing_area
from echomodel.roomboxes import RoomBoxes, footprints
from echomodel.vocabulary import vocabulary

PALETTE = {
    "wood": (181, 137, 94),
    "accent": (206, 178, 142),
    "fabric": (122, 143, 160),
    "metal": (92, 92, 98),
    "glass": (170, 205, 214),
    "ceramic": (214, 206, 196),
    "leaf": (94, 140, 82),
    "soil": (90, 70, 55),
    "shade": (240, 230, 200),
    "screen": (40, 44, 54),
    "cushion": (150, 165, 176),
    "linen": (232, 226, 214),
    "blanket": (150, 120, 104),
    "mirror": (196, 214, 222),
    "book": (150, 90, 78),
    "stem": (118, 104, 66),
}
PLAIN = (176, 172, 166)


def thumbnail(mesh: trimesh.Trimesh, pixels: int = 160, *, yaw: float = 0.6, pitch: float = 0.35) -> Image.Image:
    """Shaded orthographic picture of a mesh, seen from its front right above.

    Arguments:
        mesh: triangles in the object frame; `face_attributes["material"]` colours them where present.
        pixels: side of the picture.
        yaw, pitch: direction of view, radians; 0, 0 looks at the front (+Z) face.
    """
    side = pixels * 2  # drawn larger, then averaged down
    view = _view(yaw, pitch)
    seen = np.asarray(mesh.vertices, float) @ view.T
    low, high = seen.min(0), seen.max(0)
    size = max(high[0] - low[0], high[1] - low[1], 1e-9)
    seen = (seen - (low + high) / 2) / size * (0.9 * side) * [1, -1, 1] + [side / 2, side / 2, 0]
    face, depth = _rasterised(seen[mesh.faces], side)
    hit = face >= 0
    normal = mesh.face_normals[face[hit]] @ view.T
    normal[normal[:, 2] < 0] *= -1
    light = np.maximum(normal @ (np.array([-0.35, 0.75, 0.6]) / np.linalg.norm([-0.35, 0.75, 0.6])), 0)
    picture = np.full((side * side, 3), 250.0)
    picture[hit] = _colours(mesh)[face[hit]] * (0.4 + 0.65 * light[:, None])
    picture = _outlined(picture.reshape(side, side, 3), depth.reshape(side, side), 0.9 * side)
    image = Image.fromarray(picture.clip(0, 255).astype(np.uint8))
    return image.resize((pixels, pixels), Image.Resampling.BOX)


def _rasterised(triangles: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Nearest triangle (-1 = none) and its depth at every pixel of a square picture, by a depth buffer.

    Arguments:
        triangles: (m, 3, 3) float, corners in pixels; larger z is nearer.
    """
    low = np.ceil(triangles[..., :2].min(1) - 0.5).clip(0, side).astype(int)
    span = np.maximum(np.floor(triangles[..., :2].max(1) - 0.5).clip(-1, side - 1).astype(int) - low + 1, 0)
    a, b, c = triangles.transpose(1, 0, 2)
    double_area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    count = span.prod(1) * (np.abs(double_area) > 1e-9)
    nearest, depth = np.full(side * side, -1), np.full(side * side, -np.inf)
    ends = np.cumsum(count)
    start = 0
    while start < len(count):  # some millions of (triangle, pixel) pairs at a time
        base = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, base + 2_000_000, side="right")))
        n = count[start:stop]
        t = np.repeat(np.arange(start, stop), n)
        k = np.arange(len(t)) - np.repeat(np.cumsum(n) - n, n)
        start = stop
        if len(t) == 0:
            continue
        px, py = low[t, 0] + k % span[t, 0], low[t, 1] + k // span[t, 0]
        x, y = px + 0.5 - a[t, 0], py + 0.5 - a[t, 1]
        u = (x * (c[t, 1] - a[t, 1]) - y * (c[t, 0] - a[t, 0])) / double_area[t]
        v = (y * (b[t, 0] - a[t, 0]) - x * (b[t, 1] - a[t, 1])) / double_area[t]
        inside = (u >= 0) & (v >= 0) & (u + v <= 1)
        t, u, v, pixel = t[inside], u[inside], v[inside], (py * side + px)[inside]
        z = a[t, 2] + u * (b[t, 2] - a[t, 2]) + v * (c[t, 2] - a[t, 2])
        np.maximum.at(depth, pixel, z)
        front = z >= depth[pixel]
        nearest[pixel[front]] = t[front]
    return nearest, depth


def _view(yaw: float, pitch: float) -> np.ndarray:
    """Rows: right, up and towards the viewer, in the object's frame."""
    toward = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    right = np.array([np.cos(yaw), 0, -np.sin(yaw)])
    return np.stack([right, np.cross(toward, right), toward])


def _colours(mesh: trimesh.Trimesh) -> np.ndarray:
    if "material" not in mesh.face_attributes:
        return np.tile(np.array(PLAIN, float), (len(mesh.faces), 1))
    table = np.array([PALETTE[name] for name in MATERIALS], float)
    return table[np.asarray(mesh.face_attributes["material"])]


def _outlined(picture: np.ndarray, depth: np.ndarray, size: float) -> np.ndarray:
    """Darken pixels where the surface behind drops away, so that parts of one colour stay apart."""
    for axis in (0, 1):
        with np.errstate(invalid="ignore"):
            step = np.abs(np.diff(depth, axis=axis)) > 0.03 * size
        edge = np.zeros(depth.shape, bool)
        edge[(slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))] = step
        picture = np.where((edge & np.isfinite(depth))[..., None], picture * 0.6, picture)
    return picture


def contact_sheet(rows: Sequence[tuple[str, Sequence[trimesh.Trimesh]]], pixels: int = 120) -> Image.Image:
    """A picture with one labelled row of meshes per entry.

    Arguments:
        rows: label and meshes of each row, top to bottom.
        pixels: side of one picture.
    """
    columns = max((len(meshes) for _, meshes in rows), default=0)
    margin = 130
    sheet = Image.new("RGB", (margin + columns * pixels, max(1, len(rows)) * pixels), (250, 250, 250))
    pen = ImageDraw.Draw(sheet)
    for j, (label, meshes) in enumerate(rows):
        pen.text((6, j * pixels + pixels // 2 - 6), label, fill=(20, 20, 20))
        for i, mesh in enumerate(meshes):
            sheet.paste(thumbnail(mesh, pixels), (margin + i * pixels, j * pixels))
    return sheet


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
