"""What a picture needs to know of a stage: world-space triangles with normals, colours and textures (Y-up, metres)."""

from __future__ import annotations

import colorsys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from pxr import Usd

from echomodel.boxes2d import upright_box
from echomodel.triangles import area_normals, box
from echousd.draw.drawables import Drawable, Paint, image_of, read_drawables
from echousd.draw.indoors import Lights, read_lights
from echousd.draw.sight import Furniture

GOLDEN = 0.61803398875
LINEAR = (np.arange(256, dtype=np.float32) / 255) ** 2.2  # of a byte of sRGB
MIXED = np.array([0.3141, 0.2718, 0.1618], np.float32)  # so that no two colours of a room add up to the same
SHELL = ("floor", "wall", "ceiling", "door", "window")
SMALL = 0.35  # metres: what is no larger hides nothing that a picture is of
SMALLEST = 6  # times that an image is halved at most
# Opacity of a pane below which one looks through it; twice the m² of upright glass from which on it glazes a front.
SEEN_THROUGH, GLAZED = 0.5, 0.03
HUNG = ("picture", "mirror", "curtain", "blind", "wall_shelf", "wall_clock", "coats", "radiator")  # goes with its wall


@dataclass(frozen=True, eq=False)
class Scenery:
    """Triangles in the world, y up, metres."""

    triangles: np.ndarray  # triangles, normals: (f, 3, 3) float32 corners and their normals
    normals: np.ndarray
    flat_colors: np.ndarray  # flat_colors, emissive: (f, 3) float32 linear RGB
    emissive: np.ndarray
    gloss: np.ndarray  # (f,) float32 in [0, 1]
    st: np.ndarray  # (f, 3, 2) float32 texture coordinates
    texture: np.ndarray  # (f,) int, which of `images` colours the face, -1 for none
    # (h, w, 3) uint8 sRGB each, and (3,) float32, what its linear RGB is multiplied by
    images: tuple[tuple[np.ndarray, np.ndarray], ...]
    furniture: Furniture  # boxes of the objects
    hung: Furniture  # boxes of what hangs on walls
    wall: np.ndarray  # (f,) int, which wall a face belongs to, -1 for none
    panes: np.ndarray  # (p, 3, 3) float32: middle, half of the width and half of the height of every window's pane
    pane_wall: np.ndarray  # (p,) int, the walls of the panes
    lights: Lights  # of the stage
    above: tuple[dict[str, np.ndarray], ...] = ()  # what only a ceiling shows: the fields with an f of beams

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner, (3,) float each."""
        corners = self.triangles.reshape(-1, 3).astype(float)
        return corners.min(0), corners.max(0)

    @property
    def closed(self) -> bool:
        """Whether there are walls around it."""
        return bool((self.wall >= 0).any())

    def without_near_walls(self, eye: np.ndarray) -> Scenery:
        """The scene without the walls between the middle of the room and an eye outside, as in a doll's house."""
        lower, upper = self.bounds
        middle = (lower + upper) / 2
        keep, seen = np.ones(len(self.triangles), bool), np.ones(len(self.panes), bool)
        for number in range(int(self.wall.max(initial=-1)) + 1):
            faces = self.wall == number
            corners = self.triangles[faces].reshape(-1, 3)
            away = (corners.min(0) + corners.max(0)) / 2 - middle
            if (away * (eye - middle))[[0, 2]].sum() > 0:
                keep &= ~faces
                seen &= self.pane_wall != number
        if keep.all() or not keep.any():
            return self
        names = ("triangles", "normals", "flat_colors", "emissive", "gloss", "st", "texture", "wall")
        fewer = {name: getattr(self, name)[keep] for name in names}
        return replace(self, panes=self.panes[seen], pane_wall=self.pane_wall[seen], **fewer)

    @cached_property
    def largest(self) -> tuple[int, int]:
        """Number of the largest face that looks up, and of the largest pale one of a wall."""
        area, pale = area_normals(self.triangles), self.flat_colors.mean(1) ** 2
        level = area[:, 1] * (self.normals[:, 0, 1] > 0)
        upright = np.linalg.norm(area, axis=1) * (self.wall >= 0) * pale
        return int(level.argmax()), int(upright.argmax())

    @cached_property
    def axis(self) -> np.ndarray:
        """(f,) int, along which axis each face looks most."""
        return np.abs(self.normals[:, 0]).argmax(1)

    @cached_property
    def material(self) -> np.ndarray:
        """(f,) float32, a number that differs where colour, glow or texture do."""
        return (self.flat_colors @ MIXED + 3 * self.emissive @ MIXED + self.texture).astype(np.float32)

    @cached_property
    def texels(self) -> np.ndarray:
        """(f,) float32, pixels of its image that a metre of each face has."""
        sizes = np.array([(i.shape[1], i.shape[0]) for i, _ in self.images] or [(1, 1)], np.float32)
        flat = np.diff(self.st, axis=1) * sizes[self.texture][:, None]
        area = np.linalg.norm(area_normals(self.triangles), axis=1)
        pixels = np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0])
        return np.sqrt(pixels / np.maximum(area, 1e-9)).astype(np.float32)

    def colors(self, face: np.ndarray, st: np.ndarray, breadth: np.ndarray) -> np.ndarray:
        """(n, 3) colour of places `breadth` (n,) metres wide on faces (n,) at texture coordinates (n, 2).

        It is that of an image reduced until its pixels are so wide: finer ones would flicker ("mip map").
        """
        out, texture = self.flat_colors.take(face, 0), self.texture.take(face)
        level = np.clip(np.log2(np.maximum(breadth * self.texels.take(face), 1)), 0, SMALLEST).astype(np.int8)
        for number, (_, tint) in enumerate(self.images):
            own = np.flatnonzero(texture == number)
            for halved in np.flatnonzero(np.bincount(level.take(own))).tolist():
                here = own[level.take(own) == halved]
                right, up = st.take(here, 0).T
                out[here] = between(self.reduced(number, halved), right, 1 - up) * tint
        return out

    @cached_property
    def reduced(self) -> Callable[[int, int], np.ndarray]:
        """Number of an image, and how often its sides are halved -> (h, w, 3) uint8."""
        from PIL import Image

        return cache(lambda number, halved: np.asarray(Image.fromarray(self.images[number][0]).reduce(2**halved)))


def between(image: np.ndarray, right: np.ndarray, down: np.ndarray) -> np.ndarray:
    """(n, 3) linear RGB of an image (h, w, 3), uint8, at shares (n,) of its width and height, between its pixels; it
    goes on beyond its borders."""
    height, width = image.shape[:2]
    x, y = right * width - 0.5, down * height - 0.5
    column, row = np.floor(x), np.floor(y)
    x, y, pixels = (x - column)[:, None], (y - row)[:, None], image.reshape(-1, 3)
    left, right, above, below = (
        (first + k).astype(np.int32) % n for first, n in ((column, width), (row, height)) for k in (0, 1)
    )
    first, second = (
        (1 - x) * LINEAR.take(pixels.take(line * width + left, 0))
        + x * LINEAR.take(pixels.take(line * width + right, 0))
        for line in (above, below)
    )
    return (1 - y) * first + y * second


@cache
def class_color(category: str) -> tuple[float, float, float]:
    """One linear colour per word, spread around the colour circle, the same in every run."""
    from echomodel.vocabulary import vocabulary

    if category in SHELL:
        return (0.72, 0.71, 0.69)
    names = [entry.name for entry in vocabulary().categories]
    number = names.index(category) if category in names else sum(category.encode())
    hue = (number * GOLDEN) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.55 + 0.2 * (number % 3) / 2, 0.9 - 0.25 * (number % 4) / 3)
    return red**2.2, green**2.2, blue**2.2


def read_scenery(stage: Usd.Stage, *, by_class: bool = False) -> Scenery:
    """Collect every visible mesh of a stage.

    `stage`: any stage; Z-up and other units are converted. `by_class`: colour by the nearest
    `SemanticsLabelsAPI:category` instead of by material. Raises ValueError when there is no mesh to see.
    """
    parts: list[dict[str, np.ndarray]] = []
    images: dict[tuple, tuple[int, tuple[np.ndarray, np.ndarray]]] = {}
    boxes, curtains = list[np.ndarray](), list[np.ndarray]()
    shades: dict[str, list[np.ndarray]] = {}  # by component
    words: list[str] = []
    above = list[dict[str, np.ndarray]]()
    walls: dict[str, int] = {}  # component -> number; doors and windows belong to their wall
    panes: list[tuple[str, np.ndarray]] = []
    for mesh in read_drawables(stage):
        if mesh.category == "ceiling":  # pictures look in from above
            continue
        if mesh.category == "window" and not by_class and all(p.opacity < SEEN_THROUGH for p, _ in mesh.paints):
            panes.append((mesh.component, _pane(mesh)))
            continue  # light goes through
        if mesh.category == "wall":
            walls.setdefault(mesh.component, len(walls))
        count = len(mesh.triangles)
        turned = mesh.normals @ np.linalg.inv(mesh.world[:3, :3])  # inverse transpose, as rows
        part = {
            "triangles": (mesh.triangles @ mesh.world[:3, :3].T + mesh.world[:3, 3]).astype(np.float32),
            "normals": (turned / np.maximum(np.linalg.norm(turned, axis=-1, keepdims=True), 1e-12)).astype(np.float32),
            "st": np.zeros((count, 3, 2), np.float32) if mesh.st is None else mesh.st.astype(np.float32),
            "flat_colors": np.zeros((count, 3), np.float32), "emissive": np.zeros((count, 3), np.float32),
            "gloss": np.zeros(count, np.float32), "texture": np.full(count, -1),
            "wall": np.full(count, walls.get(mesh.component, -1)),
        }  # fmt: skip
        plain, clear = Paint(color=class_color(mesh.category), roughness=1.0), np.zeros(count, bool)
        for paint, faces in ((plain, np.arange(count)),) if by_class else mesh.paints:
            part["flat_colors"][faces], part["emissive"][faces] = paint.color, paint.emissive
            part["gloss"][faces] = min(1.0, 0.5 * (1 - paint.roughness) + 0.35 * paint.metallic)
            part["texture"][faces], clear[faces] = -1, paint.opacity < SEEN_THROUGH
            if paint.texture:
                key = (paint.texture, paint.tint)
                if key not in images:
                    pixels = image_of(paint.image, paint.texture)
                    images[key] = (len(images), (pixels, np.array(paint.tint, np.float32)))
                part["texture"][faces], (pixels, tint) = images[key]
                part["flat_colors"][faces] = LINEAR[pixels[::16, ::16]].mean((0, 1)) * tint
        if mesh.category == "beam":
            above.append(part)
            continue
        if clear.any() and not clear.all():
            across = np.abs(area_normals(part["triangles"]))
            keep = ~clear | (across[:, [0, 2]].max(1) < np.maximum(GLAZED, 3 * across[:, 1]))
            part = {key: value[keep] for key, value in part.items()}
        if (glows := part["emissive"].any(1)).any():
            shades.setdefault(mesh.component, []).append(part["triangles"][glows])
        parts.append(part)
        words.append(mesh.category)
        if mesh.category not in (*SHELL, "rug"):
            (curtains if mesh.category in HUNG else boxes).append(_box(mesh))
    if not parts:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to draw, found no visible mesh")
    _hang(parts, [*(n for n, word in enumerate(words) if word in HUNG), *_on_shelves(parts, words)], len(walls))
    joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    furniture, at_walls = (
        Furniture(found[:, :3], found[:, 3:6], found[:, 6])
        for found in (np.array(each).reshape(-1, 7) for each in ([b for b in boxes if b[:3].max() > SMALL], curtains))
    )
    return Scenery(
        images=tuple(image for _, image in images.values()), furniture=furniture, hung=at_walls,
        panes=np.array([pane for _, pane in panes], np.float32).reshape(-1, 3, 3),
        pane_wall=np.array([walls.get(wall, -1) for wall, _ in panes], int),
        lights=read_lights(stage, [np.concatenate(each) for each in shades.values()]), above=tuple(above), **joined,
    )  # fmt: skip


def _pane(mesh: Drawable) -> np.ndarray:
    """(3, 3) float: middle, half of the width and half of the height of an upright pane, metres."""
    points = mesh.triangles.reshape(-1, 3) @ mesh.world[:3, :3].T + mesh.world[:3, 3]
    low, high = points.min(0), points.max(0)
    middle, flat = (low + high) / 2, points[:, [0, 2]] - (low + high)[[0, 2]] / 2
    far = flat[int(np.argmax((flat**2).sum(1)))]
    return np.array([middle, [far[0], 0.0, far[1]], [0.0, (high[1] - low[1]) / 2, 0.0]])


def _on_shelves(parts: list[dict[str, np.ndarray]], words: list[str]) -> list[int]:
    """Numbers of the parts that stand on shelves that hang on a wall."""
    bounds = np.array([np.stack([part["triangles"].min((0, 1)), part["triangles"].max((0, 1))]) for part in parts])
    middle, out = bounds.mean(1), list[int]()
    for low, high in (bounds[n] for n, word in enumerate(words) if word == "wall_shelf"):
        inside = ((middle > low) & (middle < high))[:, [0, 2]].all(1)
        out += np.flatnonzero(inside & (bounds[:, 0, 1] > low[1]) & (bounds[:, 0, 1] < high[1] + 0.03)).tolist()
    return out


def _hang(parts: list[dict[str, np.ndarray]], hung: list[int], count: int) -> None:
    """Give what hangs on a wall the number of the nearest one."""
    bounds = []
    for number in range(count):
        corners = np.concatenate([p["triangles"][p["wall"] == number].reshape(-1, 3) for p in parts])
        bounds.append((corners.min(0), corners.max(0)))
    for index in hung if bounds else ():
        middle = parts[index]["triangles"].reshape(-1, 3).mean(0)
        apart = [np.linalg.norm(np.maximum(np.maximum(low - middle, middle - high), 0)) for low, high in bounds]
        parts[index]["wall"][:] = int(np.argmin(apart))


def _box(mesh: Drawable) -> np.ndarray:
    """(7,) float: size and bottom centre in metres and yaw of the upright box around a mesh, with its own heading."""
    points, turn = mesh.triangles.reshape(-1, 3), mesh.world[:3, :3]
    corners = box(points.min(0), points.max(0)).vertices
    return np.hstack(upright_box(corners @ turn.T + mesh.world[:3, 3], turn))
