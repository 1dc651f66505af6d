"""Rays through a scene: from which camera they come, what they run through, and what they meet."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from echomodel.triangles import along, unit
from echousd.draw.indoors import LUMA, Bounced
from echousd.draw.scenery import Scenery
from echousd.draw.views import View

BLOCK = 32_000  # rays at a time, which bounds the memory and stays in the cache
SHARED = 2_000  # rays from which on half of them run on another thread: Embree lets go of Python's lock
ABOVE = np.array([0.38, 0.84, 0.32], np.float32) / np.float32(0.9759)  # where the sun of what has no light is
# Of each pixel's shifts, a step to the right and one down: neighbours have different ones, so that smoothing sees all.
LATTICE = np.array([(0.75487767, 0.81917251, 0.54970048, 0.73389190), (0.56984029, 0.67104361, 0.85667488, 0.62870672)])
R2 = np.array([0.7548776662, 0.5698402910], np.float32)


class RenderUnavailable(ImportError, ValueError):
    """Embree is not installed; the message says how to get it."""


class Tree(NamedTuple):
    """Triangles as Embree keeps them, for rays to run through, and a thread for half of many rays."""

    scene: Any
    beside: ThreadPoolExecutor


def embree(triangles: np.ndarray) -> Tree:
    """The tree of triangles (f, 3, 3); raises RenderUnavailable without Embree."""
    try:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh
    except ImportError as error:
        raise RenderUnavailable(f'drawing needs Embree ({error}): pip install "echousd[render]"') from None
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(triangles, np.float32))
    scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))  # which builds it: no two threads shall
    return Tree(scene, ThreadPoolExecutor(1))


class World(NamedTuple):
    """What rays run through: the tree, what is in it, the camera, pixels across, shifts of the first; what light is
    thrown back, what the sun gives to what faces it, whether the picture is fine, how much brighter shades are than
    told, and the mean light, by colour; the images as they are seen; and the shadows at feet."""

    tree: Tree
    scenery: Scenery
    view: View
    size: int
    shift: np.ndarray
    thrown: Bounced
    sun: np.ndarray
    fine: bool = False
    glow: np.ndarray = np.ones(3, np.float32)
    white: np.ndarray = np.ones(3, np.float32)
    atlas: Any = None
    contact: Any = None

    @property
    def rows(self) -> int:
        """How many there are of light, see `_asked`."""
        return 5 + 3 * self.fine

    @property
    def towards(self) -> np.ndarray:
        """(3, 1) where the sun is."""
        sun = self.scenery.lights.sun if self.view.inside else None
        return (ABOVE if sun is None else sun[0])[:, None]

    @property
    def tint(self) -> np.ndarray:
        """(3, 1) the colour of the mean light."""
        return (self.white / max(float(self.white @ LUMA), 1e-6))[:, None]


class Seen(NamedTuple):
    """What n rays met: faces (n,), -1 for none; points and normals (3, n); places between the face's corners (2, n);
    and colour (3, n) of what lies around, and the share (n,) that it has in the picture as it is: all through a pane,
    some through thin cloth before one."""

    face: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    bary: np.ndarray
    glow: np.ndarray
    shown: np.ndarray

    def of(self, rows: np.ndarray) -> "Seen":
        """Those of some rays, by their numbers: `take` is four times as fast as an index is."""
        return Seen(*(value.take(rows, -1) for value in self))

    def blocks(self) -> "Iterator[tuple[slice, Seen]]":
        """Those of `BLOCK` rays at a time, and which they are."""
        for start in range(0, len(self.face), BLOCK):
            yield (here := slice(start, start + BLOCK)), Seen(*(value[..., here] for value in self))


def camera_rays(world: World, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays through places of the picture, in pixels from its upper left corner, begin and go, (3, n) float32."""
    view, axes = world.view, world.view.matrix[:3, :, None].astype(np.float32)
    u = ((x / world.size * 2 - 1) * view.half).astype(np.float32)
    v = ((1 / view.aspect - y / world.size * 2) * view.half).astype(np.float32)
    aside = u * axes[:, 0] + v * axes[:, 1]
    if view.orthographic:
        return axes[:, 3] + aside, np.broadcast_to(-axes[:, 2], aside.shape)
    way = aside - axes[:, 2]
    return axes[:, 3] + np.float32(view.near) * way, unit(way)


def first_hit(world: World, origin: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, ...]:
    """What Embree says of rays (3, n): faces (n,), -1 for none, metres to them, 0 to none, and places between their
    corners (2, n)."""
    origin, way = _rows(origin), _rows(way)
    hits = _shared(world.tree, len(way), lambda tree, at: tree.run(origin[at], way[at], output=1))
    face, far, *bary = (np.concatenate([hit[what] for hit in hits]) for what in ("primID", "tfar", "u", "v"))
    met = face >= 0
    return face, np.where(met, far, np.float32(0)), np.where(met, bary, np.float32(0))


def way_to(point: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (3, n) from points to places, and how far they are, (n,) metres."""
    way = place - point
    away = np.sqrt(np.maximum(along(way, way), 1e-12))
    return way / away, away


def free(tree: Tree, point: np.ndarray, way: np.ndarray, away: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """(n,) float32: 1 if nothing stands within `away` metres in a direction (3, n), 0 elsewhere or if not `asked`."""
    out, ask = (asked & (away <= 0.02)).astype(np.float32), np.flatnonzero(asked & (away > 0.02))
    far = np.ascontiguousarray(away[ask] - 0.01, np.float32)
    origin, way = _rows(point.take(ask, 1)), _rows(way.take(ask, 1))
    hits = _shared(tree, len(ask), lambda tree, at: tree.run(origin[at], way[at], dists=far[at], query="OCCLUDED"))
    out[ask] = np.concatenate(hits) != 0
    return out


def _shared(tree: Tree, many: int, run: Callable[[Any, slice], Any]) -> list[Any]:
    """What so many rays meet, in their order; from `SHARED` on half of them run beside the others."""
    half = many // 2 if many >= SHARED else 0
    first = tree.beside.map(partial(run, tree.scene), [slice(half)] if half else [])
    rest = run(tree.scene, slice(half, many))
    return [*first, rest]


def shifts(world: World, pixel: np.ndarray) -> np.ndarray:
    """(4, n) float32 what samples in some pixels are moved by."""
    down, across = np.divmod(pixel, world.size)
    moved = LATTICE[0][:, None] * across + LATTICE[1][:, None] * down + world.shift[:, None]
    return (moved - np.floor(moved)).astype(np.float32)


def even(number: int, shift: np.ndarray) -> np.ndarray:
    """Point `number` of the R2 sequence, which fills the unit square evenly, moved by a shift (2, n) per pixel."""
    moved = shift + (R2 * (number + 1) % 1.0)[:, None]
    return moved - np.floor(moved)  # four times as fast as a remainder


def on_sphere(square: np.ndarray) -> np.ndarray:
    """(3, n) points of the unit square (2, n), spread evenly over the unit sphere."""
    height = 2 * square[0] - 1
    radius, angle = np.sqrt(np.clip(1 - height**2, 0, 1)), np.float32(2 * np.pi) * square[1]
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)])


def _rows(vectors: np.ndarray) -> np.ndarray:
    """(n, 3) float32 of vectors (3, n), as Embree takes them: four times as fast as a copy of the transpose."""
    return np.stack([*vectors], 1, dtype=np.float32, casting="same_kind")
