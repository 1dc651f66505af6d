"""Light in a picture: rays through Embree, soft sun, occluded sky, one bounce, and the noise smoothed away."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from echousd.draw.indoors import OWN, SKY, SUN, THROWN, VIEW, exposed, thrown_back
from echousd.draw.scenery import Scenery
from echousd.draw.viewpoints import View

FINE, QUICK = 3, 2  # squared: rays per pixel
SKY_RAYS, AROUND = 3, 3  # per ray: rays towards the sky; inside a room, to what stands around


class RenderUnavailable(ImportError, ValueError):
    """Embree is not installed; the message says how to get it."""


def trace(scenery: Scenery, view: View, size: int, *, rays: int = FINE, seed: int = 0) -> np.ndarray:
    """The picture as (size / aspect, size, 3) float sRGB in [0, 1].

    Every pixel sends `rays`² rays; together they cover the sun's disc and the sky evenly, each pixel with another
    shift (randomised quasi-Monte Carlo), so that little noise is left. In a `QUICK` picture a pixel's light is that
    of its first ray wherever its others meet the same piece of surface.

    Arguments:
        scenery: triangles and their colours.
        view: the camera; inside a room its windows and lamps light it, else sun and sky from above.
        size: pixels across.
        rays: along each side of a pixel.
        seed: of the shifts; the same seed gives the same picture.
    """
    rng = np.random.default_rng(seed)
    scene = _embree(scenery)
    height = round(size / view.aspect)
    across, down = np.meshgrid(np.arange(size), np.arange(height))
    shift = ((across[..., None] * LATTICE[0] + down[..., None] * LATTICE[1] + rng.random(4)) % 1.0).astype(np.float32)
    layers = np.zeros((height, size, LAYERS), np.float32)
    rows = max(1, 200_000 // size)  # a block of rows at a time bounds the memory
    for start in range(0, height, rows):
        block = slice(start, min(height, start + rows))
        first = None
        for sample in range(rays**2):
            got = _shade(scene, scenery, view, size, rays, block, sample, shift[block], first)
            layers[block] += got
            first = got if rays <= QUICK and first is None else first
    layers /= rays**2
    light = smooth_light(layers[..., LIGHT], layers[..., NORMAL], layers[..., POINT])
    color = layers[..., ALBEDO] * light + layers[..., GLOW]
    return (exposed(color, thrown_back(scenery)) if view.inside else _tone(color)) ** (1 / 2.2)


# What a ray brings back; the light that falls on a surface is kept apart from its colour until it has been smoothed.
ALBEDO, LIGHT, GLOW, NORMAL, POINT, LAYERS = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15), 15
RINGS = (1, 2, 4, 8)  # pixels between neighbours, pass by pass


def smooth_light(light: np.ndarray, normal: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Mean of the light over neighbours on the same flat piece of surface (joint bilateral filter), (h, w, 3) each."""
    height, width = light.shape[:2]
    light, normal, point = (np.ascontiguousarray(a.transpose(2, 0, 1)) for a in (light, normal, point))
    here = _along(normal, point)
    for apart in RINGS:  # passes with ever wider holes reach far with few neighbours ("a trous")
        edge = ((0, 0), (apart, apart), (apart, apart))
        padded = [np.pad(a, edge, mode="edge") for a in (light, normal, point)]
        total, weight = np.zeros_like(light), np.zeros((height, width), np.float32)
        for down in (0, apart, 2 * apart):
            for across in (0, apart, 2 * apart):
                there = slice(None), slice(down, down + height), slice(across, across + width)
                other_light, other_normal, other_point = (a[there] for a in padded)
                turn = np.clip(_along(normal, other_normal), 0, 1)
                step = np.abs(_along(normal, other_point) - here)
                for _ in range(4):  # to the 16th power
                    turn *= turn
                share = turn * (step < 0.02)
                total += share * other_light
                weight += share
        light = np.where(weight > 1e-6, total / np.maximum(weight, 1e-6), light)
    return light.transpose(1, 2, 0)


def _along(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(h, w) scalar products of vectors whose components are planes, (3, h, w) each."""
    return np.asarray(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


ABOVE = np.array([0.38, 0.84, 0.32], np.float32) / np.float32(0.9759)
SUN_SPREAD = 0.10  # radius of the sun's disc at distance 1: soft shadows
SUN_LIGHT = np.array([1.05, 0.99, 0.90], np.float32)
SKY_LIGHT = np.array([0.90, 0.93, 0.97], np.float32)
BACKGROUND = np.array([0.90, 0.905, 0.915], np.float32) ** 2.2
OUTSIDE = (  # what is seen through a window: height in it from -1 to 1, linear colours
    np.array([-1.0, -0.55, -0.3, 0.2, 1.0]),
    np.array([(0.33, 0.42, 0.25), (0.47, 0.55, 0.40), (0.80, 0.84, 0.84), (0.74, 0.83, 0.92), (0.47, 0.65, 0.88)]),
)
# Of each pixel's shifts, a step to the right and one down: neighbours have different ones, so that smoothing sees all.
LATTICE = np.array([(0.75487767, 0.81917251, 0.54970048, 0.73389190), (0.56984029, 0.67104361, 0.85667488, 0.62870672)])
R2 = np.array([0.7548776662, 0.5698402910], np.float32)


def _embree(scenery: Scenery) -> Any:
    try:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh
    except ImportError as error:
        raise RenderUnavailable(f'drawing needs Embree ({error}): pip install "echousd[render]"') from None
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(scenery.triangles, np.float32))
    return scene


def _shade(
    scene: Any,
    scenery: Scenery,
    view: View,
    size: int,
    rays: int,
    rows: slice,
    sample: int,
    shift: np.ndarray,
    first: np.ndarray | None,
) -> np.ndarray:
    """(rows, size, LAYERS) what one ray for each pixel of some rows brings back; light that `first` has is its own."""
    across, down = sample % rays, sample // rays
    x = (np.arange(size, dtype=np.float32) + (across + 0.5) / rays) / size * 2 - 1
    y = 1 / view.aspect - (np.arange(rows.start, rows.stop, dtype=np.float32) + (down + 0.5) / rays) / size * 2
    u, v = (g.ravel() * view.half for g in np.meshgrid(x, y))
    axes, eye = view.matrix[:3, :3].astype(np.float32), view.matrix[:3, 3].astype(np.float32)
    if view.orthographic:
        origin = eye + u[:, None] * axes[:, 0] + v[:, None] * axes[:, 1]
        direction: np.ndarray = np.broadcast_to(-axes[:, 2], origin.shape)
    else:
        direction = u[:, None] * axes[:, 0] + v[:, None] * axes[:, 1] - axes[:, 2]
        direction = _unit(direction)
        origin = np.broadcast_to(eye, direction.shape)
    hit = scene.run(_f32(origin), _f32(direction), output=1)
    seen = np.flatnonzero(hit["primID"] >= 0)
    out = np.zeros((len(u), LAYERS), np.float32)
    out[:, GLOW] = BACKGROUND
    missed = np.flatnonzero(hit["primID"] < 0)
    out[missed, GLOW] = outside(scenery.panes, origin[missed], direction[missed])
    if view.inside:
        out[missed, GLOW] *= VIEW * scenery.lights.sky
    if not len(seen):
        return out.reshape(-1, size, LAYERS)
    face = hit["primID"][seen]
    bary = np.stack([1 - hit["u"][seen] - hit["v"][seen], hit["u"][seen], hit["v"][seen]], 1)
    point = origin[seen] + hit["tfar"][seen, None] * direction[seen]
    normal = np.einsum("ncx,nc->nx", scenery.normals[face], bary)
    normal = _unit(normal)
    toward = -direction[seen]
    normal = np.where(_dot(normal, toward)[:, None] < 0, -normal, normal)
    light, glow = np.empty((len(seen), 3), np.float32), scenery.emissive[face]
    ask = np.arange(len(seen))
    if first is not None:
        known = first.reshape(-1, LAYERS)[seen]
        same = (_dot(normal, known[:, NORMAL]) > 0.95) & (np.abs(_dot(normal, point - known[:, POINT])) < 0.02)
        light[same], glow[same] = known[same, LIGHT], known[same, GLOW]
        ask = np.flatnonzero(~same)
    hits = Hits(point[ask] + 2e-3 * normal[ask], normal[ask], toward[ask], scenery.gloss[face[ask]])
    light[ask], shine = (_light_inside if view.inside else _light)(
        scene, scenery, hits, sample, shift.reshape(-1, 4)[seen][ask]
    )
    glow[ask] += 0.5 * shine[:, None]
    out[seen] = np.concatenate([scenery.colors(face, bary), light, glow, normal, point], axis=1)
    return out.reshape(-1, size, LAYERS)


def outside(panes: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(n, 3) colour that rays which meet nothing see: sky over fields through a window's pane, else the paper."""
    out: np.ndarray = np.broadcast_to(BACKGROUND, direction.shape).copy()
    for middle, side, rise in panes:
        normal = np.cross(side, rise)
        along = direction @ normal
        reach = ((middle - origin) @ normal) / np.where(np.abs(along) < 1e-9, 1e-9, along)
        point = origin + reach[:, None] * direction - middle
        u, v = point @ side / (side @ side), point @ rise / (rise @ rise)
        here = (reach > 0) & (np.abs(u) <= 1) & (np.abs(v) <= 1)
        out[here] = np.stack([np.interp(v[here], OUTSIDE[0], tone) for tone in OUTSIDE[1].T], 1)
    return out


class Hits(NamedTuple):
    """Where rays met something: points just before it, its normals, the ways back (n, 3) float32, and gloss (n,)."""

    point: np.ndarray
    normal: np.ndarray
    toward: np.ndarray
    gloss: np.ndarray

    def shine(self, light: np.ndarray) -> np.ndarray:
        """(n,) how strongly light from its directions (3,) or (n, 3) is mirrored towards the eye."""
        return self.gloss * np.clip(_dot(self.normal, _unit(self.toward + light)), 0, None) ** (4 + 90 * self.gloss)


def _light(scene: Any, scenery: Scenery, hits: Hits, sample: int, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Light that falls on the points, (n, 3), and the strength of the sun's reflection, (n,)."""
    point, normal, count = hits.point, hits.normal, len(hits.point)
    sun = ABOVE + SUN_SPREAD * _on_sphere(_even(sample, shift[:, :2]))
    sun = _unit(sun)
    facing = np.clip(normal @ ABOVE, 0, None)
    lit = np.zeros(count, np.float32)
    ask = np.flatnonzero(facing > 0)
    lit[ask] = scene.run(_f32(point[ask]), _f32(sun[ask]), query="OCCLUDED") != 0
    direct = (facing * lit)[:, None] * SUN_LIGHT
    sky = np.zeros((count, 3), np.float32)
    for ray in range(SKY_RAYS):
        away = normal + _on_sphere(_even(sample * SKY_RAYS + ray, shift[:, 2:]))  # cosine-weighted
        away = _unit(away)
        other = scene.run(_f32(point), _f32(away), output=1)
        blocked = other["primID"] >= 0
        # What a sky ray meets sends back a little of its own colour: one crude bounce.
        bounce = 0.9 * scenery.flat_colors[np.clip(other["primID"], 0, None)]
        near = np.clip(other["tfar"] / 1.5, 0, 1)[:, None]
        open_sky = (0.72 + 0.28 * np.clip(away[:, 1:2], -1, 1)) * SKY_LIGHT
        sky += np.where(blocked[:, None], bounce * (0.45 + 0.55 * near), open_sky)
    sky /= SKY_RAYS
    return 0.55 * direct + 1.05 * sky, hits.shine(ABOVE) * lit


def _light_inside(
    scene: Any, scenery: Scenery, hits: Hits, sample: int, shift: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """As `_light`, in a closed room: sky in the windows, sun through them, lamps, and what the room throws back."""
    lights, point, normal, count = scenery.lights, hits.point, hits.normal, len(hits.point)
    spot, turn = _even(sample, shift[:, :2]), _even(sample, shift[:, 2:])
    light, shine = np.zeros((count, 3), np.float32), np.zeros(count, np.float32)
    if len(scenery.panes):  # one place in one window for each ray
        pane = scenery.panes[np.minimum((turn[:, 0] * len(scenery.panes)).astype(int), len(scenery.panes) - 1)]
        place = pane[:, 0] + (2 * spot[:, :1] - 1) * pane[:, 1] + (2 * spot[:, 1:] - 1) * pane[:, 2]
        way, away = _way(point, place)
        area = np.cross(pane[:, 1], pane[:, 2])  # a quarter of it
        seen = np.clip(_dot(way, normal), 0, None) * 4 * np.abs(_dot(way, area)) / np.maximum(away, 0.2) ** 2
        seen *= 0.3 + 0.7 * np.clip(0.5 + 2 * way[:, 1], 0, 1)  # sky above, ground below
        share = _free(scene, point, way, away, seen > 1e-4) * seen
        light += share[:, None] * (len(scenery.panes) * SKY * lights.sky / np.pi) * SKY_LIGHT
        shine = hits.shine(way) * (share > 0)
    if lights.sun is not None and len(scenery.panes):
        towards = _unit(lights.sun[0] + 0.02 * _on_sphere(spot))
        facing = np.clip(_dot(normal, towards), 0, None)
        lit = _free(scene, point, towards, np.full(count, 1e3, np.float32), facing > 0) * facing
        light += lit[:, None] * lights.sun[1] * np.float32(SUN / np.pi)
    if len(lights.bulbs):  # one lamp for each ray
        which = np.minimum((turn[:, 1] * len(lights.bulbs)).astype(int), len(lights.bulbs) - 1)
        way, away = _way(point, lights.bulbs[which] + 0.05 * _on_sphere(spot))
        facing = np.clip(_dot(normal, way), 0, None) * len(lights.bulbs) / np.maximum(away, OWN) ** 2
        lit = _free(scene, point, way, away - OWN, facing > 0) * facing
        light += lit[:, None] * lights.power[which] / np.float32(np.pi)
    around, thrown = np.zeros((count, 3), np.float32), thrown_back(scenery)
    for ray in range(AROUND):
        way = _unit(normal + _on_sphere(_even(sample * AROUND + ray, shift[:, 2:])))  # cosine-weighted
        other = scene.run(_f32(point), _f32(way), output=1)
        near = np.clip(other["tfar"] / 1.5, 0, 1)[:, None]
        hue = scenery.flat_colors[np.clip(other["primID"], 0, None)] / np.float32(THROWN)
        around += np.where(other["primID"][:, None] >= 0, (0.4 + 0.6 * hue) * (0.3 + 0.7 * near), 1.0)
    return light + around / AROUND * thrown + 0.8 * shine[:, None], np.zeros_like(shine)


def _way(point: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) from points to places, and how far they are, (n,) metres."""
    way = place - point
    away = np.sqrt(np.maximum(_dot(way, way), 1e-12))
    return way / away[:, None], away


def _free(scene: Any, point: np.ndarray, way: np.ndarray, away: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """(n,) float32: 1 where nothing stands within `away` metres in a direction, 0 elsewhere and where not `asked`."""
    out, ask = np.zeros(len(point), np.float32), np.flatnonzero(asked & (away > 0.02))
    out[asked & (away <= 0.02)] = 1.0
    if len(ask):
        far = np.ascontiguousarray(away[ask] - 0.01, np.float32)
        out[ask] = scene.run(_f32(point[ask]), _f32(way[ask]), dists=far, query="OCCLUDED") != 0
    return out


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("nx,nx->n", a, b)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.sqrt(np.maximum(_dot(vectors, vectors), 1e-18))[:, None]


def _even(number: int, shift: np.ndarray) -> np.ndarray:
    """Point `number` of the R2 sequence, which fills the unit square evenly, moved by a shift per pixel."""
    return (shift + R2 * (number + 1) % 1.0) % 1.0


def _on_sphere(square: np.ndarray) -> np.ndarray:
    """Points of the unit square, spread evenly over the unit sphere."""
    height = 2 * square[:, 0] - 1
    radius, angle = np.sqrt(np.clip(1 - height**2, 0, 1)), 2 * np.pi * square[:, 1]
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], 1)


def _tone(color: np.ndarray) -> np.ndarray:
    """Roll bright values off towards 1 instead of clipping them."""
    knee = 0.72
    over = np.clip(color - knee, 0, None)
    return np.where(color > knee, knee + (1 - knee) * over / (over + (1 - knee)), color)


def _f32(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)
