"""What a picture needs to know of a stage: world-space triangles with normals, colours and textures (Y-up, metres)."""

import colorsys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from PIL import Image
from pxr import Usd

from echomodel.late import Late
from echomodel.triangles import area_normals, bounds_of, box, lengths
from echomodel.vocabulary import vocabulary
from echousd.draw.drawables import LINEAR, Paint, image_of, read_drawables
from echousd.draw.indoors import LUMA, Lights, read_lights
from echousd.draw.sight import Furniture

upright_box = Late("echousd.stage.contents:upright_box")

GOLDEN = 0.61803398875
MIXED = np.array([0.3141, 0.2718, 0.1618], np.float32)  # so that no two colours of a room add up to the same
SHELL = ("floor", "wall", "ceiling", "door", "window")
SMALL = 0.35  # metres: what is no larger hides nothing that a picture is of
COLOR, RELIEF = 0, 1
LEVELS = 7  # sizes of an image, each half of the one before
# Opacity of a pane below which one looks through it; twice the m² of upright glass from which on it glazes a front.
SEEN_THROUGH, GLAZED = 0.5, 0.03
NEXT, NEAR, FAR = 2.5, 1.2, 0.6  # metres from a passage to the wall beyond, and what light there is on the way to it
CLOTH, SHEER = 0.22, 1.25  # share of light that comes through cloth, less through blinds; more through thin cloth
THIN = {"curtain": CLOTH, "blind": 0.08} | dict.fromkeys(("plant", "small_plant", "floor_plant", "flowers"), 0.2)
CEILING = np.array([0.87, 0.86, 0.84], np.float32)
SKY_LIGHT = np.array([0.90, 0.93, 0.97], np.float32)
BACKGROUND = np.array([0.90, 0.905, 0.915], np.float32) ** 2.2
HUNG = (  # goes with its wall
    "picture", "mirror", "curtain", "blind", "wall_shelf", "wall_clock", "wall_decor", "coats", "radiator",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Scenery:
    """Triangles in the world, y up, metres."""

    triangles: np.ndarray  # triangles, normals: (f, 3, 3) float32 corners and their normals
    normals: np.ndarray
    flat_colors: np.ndarray  # flat_colors, emissive: (f, 3) float32 linear RGB
    emissive: np.ndarray
    gloss: np.ndarray  # gloss, thin: (f,) float32 in [0, 1]; what comes through it of light from behind, 1: glass
    thin: np.ndarray
    st: np.ndarray  # (f, 3, 2) float32 texture coordinates
    texture: np.ndarray  # (f, 2) int, which of `images` are a face's `COLOR` and `RELIEF` (normals), -1 for none
    # each as read with its sides halved so often, `image_of`; and (3,) float32, what its linear RGB is multiplied by
    images: tuple[tuple[Callable[[int], np.ndarray], np.ndarray], ...]
    # of each object whether it hangs on a wall, its lower and upper corner (3,) in its frame, and that, (4, 4)
    things: tuple[tuple[bool, np.ndarray, np.ndarray, np.ndarray], ...]
    wall: np.ndarray  # (f,) int, which wall a face belongs to, -1 for none
    panes: np.ndarray  # (p, 3, 3) float32: middle, half of the width and half of the height of every window's pane
    pane_wall: np.ndarray  # (p,) int, the walls of the panes
    lights: Lights  # of the stage
    roofed: bool = False  # whether the stage has a ceiling, whose light it is then told for
    above: tuple[dict[str, np.ndarray], ...] = ()  # what only a ceiling shows: the fields with an f of beams

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner, (3,) float each."""
        low, high = bounds_of(self.triangles).astype(float)
        return low, high

    def furniture(self, hung: bool = False) -> Furniture:
        """Upright boxes, with their own headings, of the objects that are not small, or of what hangs on walls."""
        things = [(box(*ends).vertices, frame) for hangs, *ends, frame in self.things if hangs == hung]
        found = [np.hstack(upright_box(at @ frame[:3, :3].T + frame[:3, 3], frame[:3, :3])) for at, frame in things]
        table = np.array([one for one in found if hung or one[:3].max() > SMALL]).reshape(-1, 7)
        return Furniture(table[:, :3], table[:, 3:6], table[:, 6])

    @property
    def closed(self) -> bool:
        """Whether there are walls around it."""
        return bool((self.wall >= 0).any())

    @cached_property
    def largest(self) -> tuple[int, int]:
        """Number of the largest face that looks up, and of the largest pale one of a wall."""
        area, pale = area_normals(self.triangles), self.flat_colors.mean(1) ** 2
        level = area[:, 1] * (self.normals[:, 0, 1] > 0)
        upright = lengths(area) * (self.wall >= 0) * pale
        return int(level.argmax()), int(upright.argmax())

    @cached_property
    def planes(self) -> "Planes":
        """What rays that met faces ask of them."""
        apart = (np.concatenate([each[:, :1], each[:, 1:] - each[:, :1]], 1) for each in (self.normals, self.st))
        tables = (*(each.reshape(len(each), -1) for each in apart), self.flat_colors, self.flat_colors @ LUMA)
        material = np.append(self.flat_colors @ MIXED + 3 * self.emissive @ MIXED + self.texture[:, COLOR], -9)
        planes = [np.ascontiguousarray(each.T, np.float32) for each in (*tables, material)]
        return Planes._make([*planes, np.abs(self.normals[:, 0]).argmax(1), self.emissive.any(1)])

    @cached_property
    def texels(self) -> np.ndarray:
        """(f,) float32, pixels of its image that a metre of each face has."""
        sizes = np.ones((len(self.images) + 1, 2), np.float32)  # none for faces without an image: the last
        for number in {*self.texture[:, COLOR].tolist()} - {-1}:  # relief is laid out as its colours are
            sizes[number] = 2 * np.array(self.images[number][0](1).shape[1::-1])
        flat = np.diff(self.st, axis=1) * sizes[self.texture[:, COLOR]][:, None]
        area = lengths(area_normals(self.triangles))
        pixels = np.abs(flat[:, 0, 0] * flat[:, 1, 1] - flat[:, 0, 1] * flat[:, 1, 0])
        return np.sqrt(pixels / np.maximum(area, 1e-9)).astype(np.float32)

    def atlas(self, face: np.ndarray, breadth: np.ndarray, fine: bool = False) -> tuple[np.ndarray, ...]:
        """The images of faces (n,), if `fine` those of normals, too, as they are seen where a pixel is `breadth` (n,)
        metres wide, and halved further.

        In one row: (3, n) uint8 pixels; (3, images * `LEVELS`) int, the first of each, its width and height; and
        (3, images) float32, what each's linear RGB is multiplied by.
        """
        used = self.texture[:, : RELIEF + fine].T
        number = used.take(face, 1)
        place = self._halved(number, face, breadth)[number >= 0]
        asked = np.bincount(place, minlength=len(self.images) * LEVELS).reshape(-1, LEVELS) > 0
        pixels, places, first = [np.zeros((0, 3), np.uint8)], np.zeros((*asked.shape, 3), int), 0
        for image in sorted({*used.ravel().tolist()} - {-1}):
            finest = int(asked[image].argmax()) if asked[image].any() else LEVELS - 1
            shown = Image.fromarray(self.images[image][0](min(finest, 1))).reduce(2 ** max(finest - 1, 0))
            for level in range(LEVELS):
                places[image, level] = first, *shown.size
                if level >= finest:
                    pixels.append(np.asarray(shown).reshape(-1, 3))
                    first, shown = first + len(pixels[-1]), shown.reduce(2)
        tints = np.array([tint for _, tint in self.images], np.float32)
        tables = (each.reshape(-1, 3).T for each in (np.concatenate(pixels), places, tints))
        return tuple(map(np.ascontiguousarray, tables))

    def _halved(self, number: np.ndarray, face: np.ndarray, breadth: np.ndarray) -> np.ndarray:
        """(..., n) int, the numbers of images on faces (n,) and how often each is halved, as one."""
        level = np.log2(np.maximum(breadth * self.texels.take(face), 1))
        return number * LEVELS + np.minimum(level, LEVELS - 1).astype(np.intp)

    def told(
        self, kind: int, face: np.ndarray, bary: np.ndarray, breadth: np.ndarray, atlas: tuple[np.ndarray, ...],
        scale: np.ndarray,
    ) -> tuple[np.ndarray, ...]:  # fmt: skip
        """What images of a kind say of places `breadth` (n,) metres wide on faces (n,), at `bary` (2, n) between their
        corners: (m,) int which have one, (3, m) what it says, of a byte as `scale` (256,) has it, (m,) int its number.

        It is that of an image reduced until its pixels are so wide: finer ones would flicker ("mip map").
        """
        number = self.texture[:, kind].take(face)
        drawn = np.flatnonzero(number >= 0)
        face, (u, v), number = face.take(drawn), bary.take(drawn, 1), number.take(drawn)
        place, laid = self._halved(number, face, breadth.take(drawn)), self.planes.laid.take(face, 1)
        right, up = laid[:2] + u * laid[2:4] + v * laid[4:]
        return drawn, between(atlas[0], right, 1 - up, atlas[1].take(place, 1), scale), number

    def colors(
        self, face: np.ndarray, bary: np.ndarray, breadth: np.ndarray, atlas: tuple[np.ndarray, ...]
    ) -> np.ndarray:
        """(3, n) colour of places, as in `told`."""
        out = self.planes.color.take(face, 1)
        drawn, color, number = self.told(COLOR, face, bary, breadth, atlas, LINEAR)
        out[:, drawn] = color * atlas[2].take(number, 1)
        return out


class Planes(NamedTuple):
    """Of f faces, by plane (k, f) float32: normals and texture coordinates, at the first corner and how they differ at
    the others; colours; and (f,): how bright these are, a number that differs where colour, glow or texture do (one
    more at the end, of nothing), along which axis they look most, and whether they are of lamps."""

    normal: np.ndarray
    laid: np.ndarray
    color: np.ndarray
    luma: np.ndarray
    material: np.ndarray
    axis: np.ndarray
    glows: np.ndarray


def between(
    pixels: np.ndarray, right: np.ndarray, down: np.ndarray, place: Any, scale: np.ndarray = LINEAR
) -> np.ndarray:
    """(3, n) values of images at shares (n,) of their widths and heights, between their pixels; they go on beyond their
    borders. `pixels`: as of an `atlas`; `place`: of its places, for each; `scale`: (256,) the value of a byte."""
    first, width, height = place
    x, y = (right - np.floor(right)) * width - 0.5, (down - np.floor(down)) * height - 0.5
    column, row = np.floor(x), np.floor(y)
    x, y, column, row = (x - column).astype("f4"), (y - row).astype("f4"), column.astype(int), row.astype(int)
    left, above = column + width * (column < 0), row + height * (row < 0)
    column, row = column + 1, row + 1
    beside, below = column * (column < width), row * (row < height)
    upper, lower = (
        (1 - x) * scale.take(pixels.take(line + left, 1)) + x * scale.take(pixels.take(line + beside, 1))
        for line in (first + above * width, first + below * width)
    )
    return (1 - y) * upper + y * lower


def outside(scenery: Scenery, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3, n) colour that rays which meet nothing see: through a window's pane what lies around, else the paper; and
    which (n,) bool see through a pane."""
    out: np.ndarray = np.broadcast_to(BACKGROUND[:, None], direction.shape).copy()
    around, through = scenery.lights.view, np.zeros(out.shape[1], bool)
    for middle, side, rise in scenery.panes:
        normal = np.cross(side, rise)
        along = normal @ direction
        reach = (normal @ (middle[:, None] - origin)) / np.where(np.abs(along) < 1e-9, 1e-9, along)
        point = origin + reach * direction - middle[:, None]
        u, v = side @ point / (side @ side), rise @ point / (rise @ rise)
        here = (reach > 0) & (np.abs(u) <= 1) & (np.abs(v) <= 1)
        if around is None:
            out[:, here] = SKY_LIGHT[:, None]
        else:  # by latitude and longitude, +Z in the middle and +X left of it, as OpenEXR and Hydra have them
            x, y, z = direction[:, here]
            across, down = 0.5 - np.arctan2(x, z) / (2 * np.pi), np.arccos(np.clip(y, -1, 1)) / np.pi
            out[:, here] = between(scenery.lights.planes, across, down, (0, *around.shape[1::-1]))
        through |= here
    return out, through


def next_room(scenery: Scenery, white: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(3, n) radiance that rays see which leave by a passage: a wall and a floor like those here, in less light than
    `white` (3,), the mean in this room."""
    low, high = (each[:, None] for each in scenery.bounds)
    floor, wall = scenery.largest
    way = np.where(np.abs(direction) < 1e-6, 1e-6, direction)
    leaves = np.maximum((low - origin) / way, (high - origin) / way)[[0, 2]].min(0)
    down = np.where(way[1] < 0, (scenery.triangles[floor, 0, 1] - origin[1]) / way[1], np.inf)
    far = np.clip((down - leaves) * np.hypot(way[0], way[2]) / NEXT, 0, 1)
    color = np.where(far < 1, scenery.flat_colors[floor, :, None], scenery.flat_colors[wall, :, None])
    return np.asarray(white[:, None] * color * (NEAR + (FAR - NEAR) * far), np.float32)


@cache
def class_color(category: str) -> tuple[float, float, float]:
    """One linear colour per word, spread around the colour circle, the same in every run."""
    if category in SHELL:
        return (0.72, 0.71, 0.69)
    names = [entry.name for entry in vocabulary().categories]
    number = names.index(category) if category in names else sum(category.encode())
    hue = (number * GOLDEN) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.55 + 0.2 * (number % 3) / 2, 0.9 - 0.25 * (number % 4) / 3)
    return red**2.2, green**2.2, blue**2.2


def read_scenery(stage: Usd.Stage, *, by_class: bool = False, halved: int = 0) -> Scenery:
    """Collect every visible mesh of a stage.

    `stage`: any stage; Z-up and other units are converted. `by_class`: colour by the nearest
    `SemanticsLabelsAPI:category` instead of by material. `halved`: as in `read_lights`. Raises ValueError when there is
    no mesh to see.
    """
    parts: list[dict[str, np.ndarray]] = []
    images: dict[tuple, tuple[Callable[[int], np.ndarray], np.ndarray]] = {}
    files: dict[str, Callable[[int], np.ndarray]] = {}  # of these
    means: dict[tuple, np.ndarray] = {}  # colours of these
    things = list[tuple[bool, np.ndarray, np.ndarray, np.ndarray]]()
    shades: dict[str, list[np.ndarray]] = {}  # by component
    words: list[str] = []
    above = list[dict[str, np.ndarray]]()
    walls: dict[str, int] = {}  # component -> number; doors and windows belong to their wall
    panes: list[tuple[str, np.ndarray]] = []
    roofed = False
    for mesh in read_drawables(stage):
        if mesh.category == "ceiling":  # pictures look in from above
            roofed = True
            continue
        points = mesh.triangles.reshape(-1, 3) @ mesh.world[:3, :3].T + mesh.world[:3, 3]
        if mesh.category == "window" and not by_class and all(p.opacity < SEEN_THROUGH for p, _ in mesh.paints):
            panes.append((mesh.component, _pane(points)))
            continue  # light goes through
        if mesh.category == "wall":
            walls.setdefault(mesh.component, len(walls))
        count = len(mesh.triangles)
        turned = mesh.normals.reshape(-1, 3) @ np.linalg.inv(mesh.world[:3, :3])  # inverse transpose, as rows
        turned = turned / np.maximum(lengths(turned), 1e-12)[:, None]
        part = plain_faces(points.reshape(-1, 3, 3), turned.reshape(-1, 3, 3), wall=walls.get(mesh.component, -1))
        part["thin"][:], part["st"][:] = THIN.get(mesh.category, 0.0), 0 if mesh.st is None else mesh.st
        plain, clear = Paint(color=class_color(mesh.category), roughness=1.0), np.zeros(count, bool)
        for paint, faces in ((plain, np.arange(count)),) if by_class else mesh.paints:
            part["flat_colors"][faces], part["emissive"][faces] = paint.color, paint.emissive
            part["gloss"][faces] = min(1.0, 0.5 * (1 - paint.roughness) + 0.35 * paint.metallic)
            part["texture"][faces], clear[faces] = (-1, -1), paint.opacity < SEEN_THROUGH
            part["thin"][faces] *= SHEER if paint.opacity < 1 else 1
            if paint.texture:
                found = cache(partial(image_of, paint.image, paint.texture))
                key, read = (paint.texture, paint.tint), files.setdefault(paint.texture, found)
                _, tint = images.setdefault(key, (read, np.array(paint.tint, np.float32)))
                part["texture"][faces, COLOR] = [*images].index(key)
                # most images are seen in half their size at most, in which a JPEG is read in half of the time
                if key not in means:
                    means[key] = LINEAR[read(1)[::8, ::8]].mean((0, 1)) * tint
                part["flat_colors"][faces] = means[key]
                if paint.normal:
                    found = cache(partial(image_of, paint.normal.prim, paint.normal.path))
                    images.setdefault((paint.normal,), (found, np.ones(3, np.float32)))
                    part["texture"][faces, RELIEF] = [*images].index((paint.normal,))
        if mesh.category == "beam":
            above.append(part)
            continue
        part["thin"][clear] = 1
        if clear.any() and not clear.all():
            across = np.abs(area_normals(part["triangles"]))
            keep = ~clear | (across[:, [0, 2]].max(1) < np.maximum(GLAZED, 3 * across[:, 1]))
            part = {key: value[keep] for key, value in part.items()}
        if (glows := part["emissive"].any(1)).any():
            shades.setdefault(mesh.component, []).append(part["triangles"][glows])
        parts.append(part)
        words.append(mesh.category)
        if mesh.category not in (*SHELL, "rug"):
            low, high = bounds_of(mesh.triangles)
            things.append((mesh.category in HUNG, low, high, mesh.world))
    if not parts:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to draw, found no visible mesh")
    _hang(parts, [*(n for n, word in enumerate(words) if word in HUNG), *_on_shelves(parts, words)], len(walls))
    joined = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    return Scenery(
        images=tuple(images.values()), things=tuple(things),
        panes=np.array([pane for _, pane in panes], np.float32).reshape(-1, 3, 3),
        pane_wall=np.array([walls.get(wall, -1) for wall, _ in panes], int),
        lights=read_lights(stage, [np.concatenate(each) for each in shades.values()], halved),
        roofed=roofed, above=tuple(above), **joined,
    )  # fmt: skip


def with_ceiling(scenery: Scenery) -> Scenery:
    """The scene with a ceiling over its walls, and its beams; where it has none, in the light that it would be told."""
    (left, _, back), (right, _, front) = scenery.bounds
    y = scenery.triangles[scenery.wall >= 0][..., 1].max()
    corners = np.array([(left, y, back), (right, y, back), (right, y, front), (left, y, front)], np.float32)
    added = plain_faces(corners[[[0, 1, 2], [0, 2, 3]]], np.broadcast_to(np.array([0, -1, 0]), (2, 3, 3)), CEILING)
    parts = [{key: getattr(scenery, key) for key in added}, *scenery.above, added]
    joined: dict[str, Any] = {key: np.concatenate([part[key] for part in parts]) for key in added}
    lights = scenery.lights if scenery.roofed else scenery.lights.below_ceiling()
    return replace(scenery, above=(), lights=lights, **joined)


def plain_faces(triangles: np.ndarray, normals: np.ndarray, color: Any = 0, wall: int = -1) -> dict[str, np.ndarray]:
    """The fields of a scenery with an f, of faces without images; arguments as there, one colour and wall for all."""
    size, kind = len(triangles), np.float32
    return {
        "triangles": triangles.astype(kind), "normals": normals.astype(kind), "st": np.zeros((size, 3, 2), kind),
        "flat_colors": np.full((size, 3), color, kind), "emissive": np.zeros((size, 3), kind),
        "gloss": np.zeros(size, kind), "thin": np.zeros(size, kind), "texture": np.full((size, 2), -1),
        "wall": np.full(size, wall),
    }  # fmt: skip


def _pane(points: np.ndarray) -> np.ndarray:
    """(3, 3) float: middle, half of the width and half of the height of an upright pane of corners (n, 3), metres."""
    low, high = points.min(0), points.max(0)
    middle, flat = (low + high) / 2, points[:, [0, 2]] - (low + high)[[0, 2]] / 2
    far = flat[int(np.argmax((flat**2).sum(1)))]
    return np.array([middle, [far[0], 0.0, far[1]], [0.0, (high[1] - low[1]) / 2, 0.0]])


def _on_shelves(parts: list[dict[str, np.ndarray]], words: list[str]) -> list[int]:
    """Numbers of the parts that stand on shelves that hang on a wall."""
    if "wall_shelf" not in words:
        return []
    bounds = np.array([bounds_of(part["triangles"]) for part in parts])
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
        bounds.append(bounds_of(corners))
    for index in hung if bounds else ():
        middle = parts[index]["triangles"].reshape(-1, 3).mean(0)
        apart = [np.linalg.norm(np.maximum(np.maximum(low - middle, middle - high), 0)) for low, high in bounds]
        parts[index]["wall"][:] = int(np.argmin(apart))
