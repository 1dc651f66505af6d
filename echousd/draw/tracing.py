"""Light in a picture: rays through Embree, soft sun, occluded sky, what surfaces throw on, the noise smoothed away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from echomodel.triangles import along
from echousd.draw.bounced import Bounced
from echousd.draw.indoors import DIM, GLOWING, LUMA, OWN, RIM, SKY, SUN, VIEW, evened, exposure, rolled
from echousd.draw.scenery import Scenery, between
from echousd.draw.views import View

FINE, QUICK = 3, 2  # squared: rays per pixel
AROUND = 2  # per ray: rays to what stands around
# Places at which a room's light is found, rays of each kind from each, and how often light is thrown on.
PLACES, OFTEN, TURNS = (600, 1200), 3, 3
# Metres from which on nothing makes a place darker, how dark what touches it does, and how much less if it is white.
CREVICE, DEPTH, PALE = 0.45, 1.9, 0.55
# Gloss from which on surfaces mirror, and are metal, of which so much is not mirrored; how far from where a mirror
# would a rough one mirrors.
GLOSSY, METAL, MATT, BLUR = 0.2, 0.5, 0.4, 0.15


class RenderUnavailable(ImportError, ValueError):
    """Embree is not installed; the message says how to get it."""


def trace(scenery: Scenery, view: View, size: int, *, rays: int = FINE, seed: int = 0) -> np.ndarray:
    """The picture as (size / aspect, size, 3) float sRGB in [0, 1].

    Pixels at edges send `rays`² rays, others one. Light is asked at every second pixel of every second row, twice
    `rays` times at edges, (`rays` - 1)² times elsewhere. What asks covers the sun's disc and the sky evenly, each pixel
    with another shift (randomised quasi-Monte Carlo), so that little noise is left.

    `scenery`: triangles and their colours. `view`: the camera; inside a room its windows and lamps light it, else sun
    and sky from above. `size`: pixels across. `rays`: along each side of a pixel. `seed`: of the shifts; the same seed
    gives the same picture.
    """
    height = round(size / view.aspect)
    shift = np.random.default_rng(seed).random(4)
    sun = scenery.lights.sun
    sun = np.float32(SUN / np.pi) * (0 * SUN_LIGHT if sun is None else sun[1]) if view.inside else 0.55 * SUN_LIGHT
    world = World(embree(scenery.triangles), scenery, view, size, shift, Bounced.dark(*scenery.bounds), sun)
    return _drawn(_lit(world), height, rays) ** (1 / 2.2)


def _drawn(world: World, height: int, rays: int) -> np.ndarray:
    """(height, size, 3) linear colours of the picture, of each ray as it is shown: so edges of what glares are even."""
    size, many = world.size, rays**2
    places = [((3 * (inner + 1) % (many + 1) - 0.5) / many, (inner + 0.5) / many) for inner in range(many)]
    _, seen = _met(world, np.arange(height * size), places[0])
    near = _at_edges(seen, (height, size))
    finer = [_met(world, np.flatnonzero(near), place, seen) for place in places[1:]]
    edge = np.zeros(height * size, bool)
    for pixel, _ in finer:
        edge[pixel] = True
    light = _light_of(world, seen, near, edge, 2 * rays, max(1, (rays - 1) ** 2))
    color = seen.glow.copy()
    everywhere = np.flatnonzero(seen.face >= 0)
    for met in (everywhere[start : start + BLOCK] for start in range(0, len(everywhere), BLOCK)):
        color[met] = _colored(world, seen.of(met), light.take(met, 0))
    own = everywhere[world.scenery.emissive[seen.face[everywhere]].sum(1) == 0]  # no lamp, and nothing outside
    tone = exposure(color[own] if len(own) else color, world.white, world.scenery.lights.day)
    tone = tone if world.view.inside else rolled
    color = tone(color)
    mixed = color.copy()
    for pixel, more in finer:
        met = np.flatnonzero(more.face >= 0)
        lent = _lent(world, more.of(met), pixel[met], seen, light)
        more.glow[met] = _colored(world, more.of(met), lent)
        mixed[pixel] += (tone(more.glow) - color[pixel]) / many
    mixed = mixed.reshape(height, size, 3)
    return np.where(edge.reshape(height, size, 1), _softened(mixed), mixed)


def _softened(picture: np.ndarray) -> np.ndarray:
    """A picture (h, w, 3), a quarter of each pixel from both beside it and a quarter from above and below."""
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    rows = padded[1:-1] * 0.75 + (padded[:-2] + padded[2:]) * 0.125
    return rows[:, 1:-1] * 0.75 + (rows[:, :-2] + rows[:, 2:]) * 0.125


BLOCK = 32_000  # rays at a time, which bounds the memory and stays in the cache
BAND = 64  # rows of a picture at a time, for the same reasons
RINGS = (1, 2, 4, 8)  # places between neighbours, pass by pass
# Pixels to the right and down, near ones first.
BESIDE = np.array(sorted(product(range(-2, 3), repeat=2), key=lambda at: at[0] ** 2 + at[1] ** 2)[:13])
POOL, CORNERS = 0.15, np.array(list(product((0, 1), repeat=3)))  # metres; of a cell of these
CLOSE, EVEN = 2, 0.4  # from which ring on it matters how bright neighbours are, and the share that they may differ by
ALIKE, FLAT = 0.97, 0.02  # cosine and metres within which two points lie on one flat piece of surface
KEPT, NOTHING = ("primID", "u", "v", "tfar"), np.float32(-9)  # of a hit; the material of what is not there
NEXT, NEAR, FAR = 2.5, 1.2, 0.6  # metres from a passage to the wall beyond, and what light there is on the way to it
BEFORE = np.float32(2e-3)  # metres before a surface, from where on it is no more in the way of its own light
MIRROR = 0.8  # gloss of what mirrors like glass with silver behind it


class World(NamedTuple):
    """What rays run through: the tree, what is in it, the camera, pixels across, shifts of the first; what light is
    thrown back, what the sun gives to what faces it, how much brighter shades are than told, and the mean
    light, by colour."""

    scene: Any
    scenery: Scenery
    view: View
    size: int
    shift: np.ndarray
    thrown: Bounced
    sun: np.ndarray
    glow: np.ndarray = np.ones(3, np.float32)
    white: np.ndarray = np.ones(3, np.float32)


class Seen(NamedTuple):
    """What n rays met: faces (n,), -1 for none; points and normals (n, 3), st (n, 2); colour (n, 3) where none is."""

    face: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    st: np.ndarray
    glow: np.ndarray
    material: np.ndarray

    def of(self, rows: np.ndarray) -> Seen:
        """Those of some rays, by their numbers: `take` is four times as fast as an index is."""
        return Seen(*(value.take(rows, 0) for value in self))


def _rays(world: World, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays through places of the picture, in pixels from its upper left corner, begin and go, (n, 3) float32."""
    view, axes = world.view, world.view.matrix.astype(np.float32)
    u = ((x / world.size * 2 - 1) * view.half).astype(np.float32)[:, None]
    v = ((1 / view.aspect - y / world.size * 2) * view.half).astype(np.float32)[:, None]
    aside = u * axes[:3, 0] + v * axes[:3, 1]
    if view.orthographic:
        return axes[:3, 3] + aside, np.broadcast_to(-axes[:3, 2], aside.shape)
    way = aside - axes[:3, 2]
    return axes[:3, 3] + np.float32(view.near) * way, _unit(way)


def _met(
    world: World, pixel: np.ndarray, place: tuple[float, float], first: Seen | None = None
) -> tuple[np.ndarray, Seen]:
    """What is seen at a place (right, down) in some pixels, and in which.

    Where `first` tells what was seen in each pixel already: only what is another surface or material.
    """
    parts: list[Seen] = []
    pixels = []
    for rows in (pixel[start : start + BLOCK] for start in range(0, max(len(pixel), 1), BLOCK)):
        origin, direction = _rays(world, rows % world.size + place[0], rows // world.size + place[1])
        hit = world.scene.run(_f32(origin), _f32(direction), output=1)
        if first is not None:
            new = np.flatnonzero(hit["primID"] != first.face.take(rows))
            origin, direction, rows = (each.take(new, 0) for each in (origin, direction, rows))
            hit = {key: hit[key].take(new) for key in KEPT}
        part = _seen(world, origin, direction, hit)
        mirror = np.flatnonzero((part.face >= 0) & (world.scenery.gloss.take(part.face) > MIRROR))
        if len(mirror):  # who looks into a mirror sees what is before it
            way = direction[mirror] - 2 * _dot(direction[mirror], part.normal[mirror])[:, None] * part.normal[mirror]
            origin = part.point[mirror] + BEFORE * part.normal[mirror]
            before = _seen(world, origin, way, world.scene.run(_f32(origin), _f32(way), output=1))
            for own, other in zip(part, before, strict=True):
                own[mirror] = other
        if first is not None:
            differs = np.flatnonzero(_other(part, first.of(rows)))
            part, rows = part.of(differs), rows.take(differs)
        parts.append(part)
        pixels.append(rows)
    return np.concatenate(pixels), Seen(*map(np.concatenate, zip(*parts, strict=True)))


def _other(one: Seen, two: Seen) -> np.ndarray:
    """(n,) bool: what is another surface or material."""
    return (one.material != two.material) | ~_same(one.normal, one.point, two.normal, two.point)


def _at_edges(seen: Seen, shape: tuple[int, int]) -> np.ndarray:
    """(n,) bool of a picture's pixels: whether another surface is seen beside them, or beside their neighbours."""
    values, out = [value.reshape(*shape, *value.shape[1:]) for value in seen], np.zeros(shape, bool)
    across = (slice(None), slice(None, -1)), (slice(None), slice(1, None))
    for one, two in (across, (slice(None, -1), slice(1, None))):
        differs = _other(*(Seen(*(value[part] for value in values)) for part in (one, two)))
        out[one] |= differs
        out[two] |= differs
    wide = np.pad(out, 1)
    return (out | wide[2:, 1:-1] | wide[:-2, 1:-1] | wide[1:-1, 2:] | wide[1:-1, :-2]).ravel()


def _seen(world: World, origin: np.ndarray, direction: np.ndarray, hit: Mapping[str, np.ndarray]) -> Seen:
    """What rays met, of what Embree says of them."""
    scenery, face = world.scenery, hit["primID"]
    missed = np.flatnonzero(face < 0)
    glow = np.zeros((len(face), 3), np.float32)
    glow[missed], through = outside(scenery, origin.take(missed, 0), direction.take(missed, 0))
    if world.view.inside:
        glow *= np.float32(VIEW * scenery.lights.sky) * scenery.lights.tint
        if len(past := missed[~through]):
            glow[past] = _next_room(world, origin[past], direction[past])
    u, v, far = (np.where(face < 0, np.float32(0), hit[key]) for key in ("u", "v", "tfar"))
    bary = np.stack([1 - u - v, u, v], 1)
    normal = _unit(np.einsum("ncx,nc->nx", scenery.normals.take(face, 0), bary))
    normal[_dot(normal, direction) > 0] *= -1
    point = origin + far[:, None] * direction
    st = np.einsum("ncx,nc->nx", scenery.st.take(face, 0), bary)
    return Seen(face, point, normal, st, glow, np.where(face < 0, NOTHING, scenery.material.take(face)))


def _asked(world: World, seen: Seen, pixel: np.ndarray, samples: int) -> np.ndarray:
    """(n, 6) what falls on what was seen in some pixels: soft light by colour, what is mirrored to the eye, how
    free the place is of what stands near, see `CREVICE`, and the share of the sun that shines there."""
    view, out = world.view, np.zeros((len(pixel), 6), np.float32)
    for rows in (slice(start, start + BLOCK) for start in range(0, len(pixel), BLOCK)):
        point, normal, gloss = seen.point[rows], seen.normal[rows], world.scenery.gloss.take(seen.face[rows])
        toward = np.broadcast_to(view.matrix[:3, 2], point.shape) if view.orthographic else view.matrix[:3, 3] - point
        hits = Hits(point + BEFORE * normal, normal, _unit(toward.astype("f4")), gloss)
        shift = _shifts(world, pixel[rows])
        for sample in range(samples):
            out[rows] += _light(world, hits, sample, shift)
    return out / samples


def _shifts(world: World, pixel: np.ndarray) -> np.ndarray:
    """(n, 4) float32 what samples in some pixels are moved by."""
    across, down = pixel[:, None] % world.size, pixel[:, None] // world.size
    moved = across * LATTICE[0] + down * LATTICE[1] + world.shift
    return (moved - np.floor(moved)).astype(np.float32)


def _light_of(world: World, seen: Seen, near: np.ndarray, edge: np.ndarray, often: int, seldom: int) -> np.ndarray:
    """(n, 6) light at all pixels: asked at every second of every second row, lent to those of the same surface.

    Where there is little of a surface around to smooth the light over, at an `edge` (n,), it is asked `often`, and what
    is `near` one (n,) shares it by place: trims a pixel wide have no neighbours in rows and columns.
    """
    shape = len(seen.face) // world.size, world.size
    met, coarse = seen.face.reshape(shape) >= 0, np.s_[::2, ::2]
    normal, point = (each.reshape(*shape, 3) for each in (seen.normal, seen.point))
    asked, torn, number = met[coarse], edge.reshape(shape)[coarse], np.arange(met.size).reshape(shape)[coarse]
    found, light = np.zeros((*asked.shape, 6), np.float32), np.zeros((*shape, 6), np.float32)
    for here, times in ((asked & torn, often), (asked & ~torn, seldom)):
        found[here] = _asked(world, seen.of(number[here]), number[here], times)
    thin = asked & near.reshape(shape)[coarse]
    found[thin, :5] = _pooled(seen.of(number[thin]), found[thin, :5])
    inside = world.view.inside
    for layers, rings in ((slice(3), RINGS), (slice(3, 5), RINGS[:3]), (slice(5, 6), () if inside else RINGS)):
        found[..., layers] = smooth_light(found[..., layers], normal[coarse], point[coarse], rings)
    lit = smooth_light((found[..., 5:] > 0).astype(np.float32), normal[coarse], point[coarse], RINGS[:1])
    mixed = ((lit > 0.01) & (lit < 0.99))[..., 0].repeat(2, 0).repeat(2, 1)[: shape[0], : shape[1]]
    weight, more = np.zeros((*shape, 1), np.float32), ((0, 1), (0, 1), (0, 0))
    known = [np.pad(each, more, "edge") for each in (asked[..., None], normal[coarse], point[coarse], found)]
    for odd in product((0, 1), repeat=2):  # of the one, two or four that were asked around it, those of its own surface
        here = tuple(slice(each, None, 2) for each in odd)
        for steps in product(*(range(each + 1) for each in odd)):
            beside = tuple(slice(step, step + many) for step, many in zip(steps, light[here].shape, strict=False))
            there, *surface, lent = (each[beside] for each in known)
            fits = there & _same(normal[here], point[here], *surface)[..., None]
            light[here] += fits * lent
            weight[here] += fits
    light /= np.maximum(weight, 1)
    rest = np.flatnonzero(met & (weight[..., 0] == 0))
    light.reshape(-1, 6)[rest] = _pooled(seen.of(rest), _asked(world, seen.of(rest), rest, often // 2))
    border = np.flatnonzero(met & mixed & inside)  # of the sun's light: sharper than two pixels
    there, facing, shift = seen.point[border], seen.normal[border], _shifts(world, border)[:, :2]
    suns = [_sunny(world, there + BEFORE * facing, facing, _even(n, shift)) for n in range(often)]
    light.reshape(-1, 6)[border, 5] = np.mean(suns, 0)
    return smooth_light(light, normal, point, RINGS[:1]).reshape(-1, 6)


def _pooled(seen: Seen, light: np.ndarray) -> np.ndarray:
    """(n, c) light on what was seen: its mean over what faces the same way within `POOL` metres, the nearer the more.

    Places lie between the corners of cells, which they add their light to, and take the mean from.
    """
    place = seen.point / POOL
    low = np.floor(place)
    cell = np.column_stack([low, np.rint(2 * seen.normal) + 2]).astype(np.int64) @ (1 << np.arange(48, 0, -8))
    share = np.stack([1 + low - place, place - low])
    weight = np.stack([share[x, :, 0] * share[y, :, 1] * share[z, :, 2] for x, y, z in CORNERS])
    _, corner = np.unique(cell + CORNERS @ (1 << np.array([48, 40, 32]))[:, None], return_inverse=True)
    corner = corner.reshape(weight.shape)
    held = np.stack([np.bincount(corner.ravel(), (weight * part).ravel()) for part in (np.ones(len(light)), *light.T)])
    taken = (held.take(corner, 1) * weight).sum(1)
    return np.asarray((taken[1:] / np.maximum(taken[0], 1e-9)).T, np.float32)


def _same(normal: np.ndarray, point: np.ndarray, other_normal: np.ndarray, other_point: np.ndarray) -> np.ndarray:
    """Whether points lie on one flat piece of surface, (...) bool of (..., 3)."""
    return (_dot(normal, other_normal) > ALIKE) & (np.abs(_dot(normal, point - other_point)) < FLAT)


def _lent(world: World, met: Seen, pixel: np.ndarray, seen: Seen, light: np.ndarray) -> np.ndarray:
    """(n, 6) light of what further rays in some pixels met: that of the same surface there or beside it, else asked."""
    out, wanted = np.zeros((len(pixel), 6), np.float32), np.arange(len(pixel))
    for apart in BESIDE @ (1, world.size):
        other = np.clip(pixel.take(wanted) + apart, 0, len(light) - 1)
        own = met.normal.take(wanted, 0), met.point.take(wanted, 0)
        fits = (seen.face.take(other) >= 0) & _same(*own, seen.normal.take(other, 0), seen.point.take(other, 0))
        out[wanted[fits]] = light.take(other[fits], 0)
        wanted = wanted[~fits]
    rest, pixel = met.of(wanted), pixel[wanted]
    out[wanted] = _pooled(rest, _asked(world, rest, pixel, 1))
    return out


def _colored(world: World, seen: Seen, light: np.ndarray) -> np.ndarray:
    """(n, 3) radiance of what was seen in light (n, 6)."""
    scenery = world.scenery
    color = scenery.colors(seen.face, seen.st, _breadth(world, seen))
    sun = light[:, 5:] * world.sun
    fallen = (light[:, :3] * light[:, 4:5] ** np.float32(DEPTH) + sun) * evened(light[:, :3] + sun, world.white)
    emissive = scenery.emissive.take(seen.face, 0)
    glow = light[:, 3:4] + emissive
    if len(metal := np.flatnonzero(scenery.gloss.take(seen.face) > METAL)):
        glow[metal] *= color[metal]
        fallen[metal] *= MATT
    if len(shade := np.flatnonzero(emissive.any(1))):
        glow[shade] *= world.glow * _through(world, seen.of(shade))[:, None]
        fallen[shade] = 0  # but little of what they throw on themselves
    return color * fallen + glow


def _through(world: World, seen: Seen) -> np.ndarray:
    """(n,) in [0, 1] how much of a lamp's light comes through its shade: most at the bulb, little at its rim."""
    back, bulbs = _unit(world.view.matrix[:3, 3].astype(np.float32) - seen.point), world.scenery.lights.bulbs.mean(1)
    share = np.clip(_dot(back, seen.normal), 0, 1)
    if len(bulbs):
        away = seen.point[:, None] - bulbs
        share *= _dot(_unit(away[np.arange(len(away)), (away**2).sum(2).argmin(1)]), seen.normal) ** 2
    return np.asarray(RIM + (1 - RIM) * share)


def _breadth(world: World, seen: Seen) -> np.ndarray:
    """(n,) metres of what was seen that a pixel shows, the mean of both ways over it."""
    back = world.view.matrix[:3, 3].astype(np.float32) - seen.point
    away = np.sqrt(_dot(back, back))
    slant = np.clip(_dot(back, seen.normal) / away, 0.05, 1)
    return np.asarray(2 * world.view.half / world.size * (away / np.sqrt(slant)) ** (not world.view.orthographic))


def smooth_light(light: np.ndarray, normal: np.ndarray, point: np.ndarray, rings: Sequence[int] = RINGS) -> np.ndarray:
    """Mean of the light (h, w, c) over neighbours on the same flat piece of surface (joint bilateral filter).

    Far passes leave out what is much lighter or darker, so that shadows keep their edges. `normal`, `point`: (h, w, 3)
    of the surface.
    """
    light, normal, point = (np.ascontiguousarray(each.transpose(2, 0, 1)) for each in (light, normal, point))
    _, height, width = light.shape
    for apart in rings:  # passes with ever wider holes reach far with few neighbours ("a trous")
        total, weight, bright = light.copy(), np.ones((height, width), np.float32), light.mean(0)
        # what two share they give each other: half of all eight are met
        for down, across in ((0, apart), (apart, -apart), (apart, 0), (apart, apart)):
            for top in range(0, height - down, BAND):
                bottom, left, right = min(top + BAND, height - down), max(-across, 0), width - max(across, 0)
                here = np.s_[..., top:bottom, left:right]
                there = np.s_[..., top + down : bottom + down, left + across : right + across]
                share = np.maximum(along(normal[here], normal[there]), 0) ** 32
                share *= np.abs(along(normal[here], point[there] - point[here])) < FLAT
                for one, other in ((here, there), (there, here)):
                    part = share
                    if apart > CLOSE:
                        part = share / (1 + np.square((bright[other] - bright[one]) / (EVEN * bright[one] + 1e-4)) ** 2)
                    total[one] += part * light[other]
                    weight[one] += part
        light = total / weight
    return np.ascontiguousarray(light.transpose(1, 2, 0))


ABOVE = np.array([0.38, 0.84, 0.32], np.float32) / np.float32(0.9759)
SUN_SPREAD = 0.10  # radius of the sun's disc at distance 1: soft shadows
SUN_LIGHT = np.array([1.05, 0.99, 0.90], np.float32)
SKY_LIGHT = np.array([0.90, 0.93, 0.97], np.float32)
BACKGROUND = np.array([0.90, 0.905, 0.915], np.float32) ** 2.2
# Of each pixel's shifts, a step to the right and one down: neighbours have different ones, so that smoothing sees all.
LATTICE = np.array([(0.75487767, 0.81917251, 0.54970048, 0.73389190), (0.56984029, 0.67104361, 0.85667488, 0.62870672)])
R2 = np.array([0.7548776662, 0.5698402910], np.float32)


def embree(triangles: np.ndarray) -> Any:
    """The tree of Embree of triangles (f, 3, 3), which rays are run through; raises RenderUnavailable without it."""
    try:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh
    except ImportError as error:
        raise RenderUnavailable(f'drawing needs Embree ({error}): pip install "echousd[render]"') from None
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, _f32(triangles))
    return scene


def outside(scenery: Scenery, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) colour that rays which meet nothing see: through a window's pane what lies around, else the paper; and
    which (n,) bool see through a pane."""
    out: np.ndarray = np.broadcast_to(BACKGROUND, direction.shape).copy()
    around, through = scenery.lights.view, np.zeros(len(out), bool)
    for middle, side, rise in scenery.panes:
        normal = np.cross(side, rise)
        along = direction @ normal
        reach = ((middle - origin) @ normal) / np.where(np.abs(along) < 1e-9, 1e-9, along)
        point = origin + reach[:, None] * direction - middle
        u, v = point @ side / (side @ side), point @ rise / (rise @ rise)
        here = (reach > 0) & (np.abs(u) <= 1) & (np.abs(v) <= 1)
        out[here] = SKY_LIGHT if around is None else _around(around, direction[here])
        through |= here
    return out, through


def _next_room(world: World, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(n, 3) radiance that rays see which leave by a passage: a wall and a floor like those here, in less light."""
    scenery, (low, high) = world.scenery, world.scenery.bounds
    floor, wall = scenery.largest
    way = np.where(np.abs(direction) < 1e-6, 1e-6, direction)
    leaves = np.maximum((low - origin) / way, (high - origin) / way)[:, [0, 2]].min(1)
    down = np.where(way[:, 1] < 0, (scenery.triangles[floor, 0, 1] - origin[:, 1]) / way[:, 1], np.inf)
    far = np.clip((down - leaves) * np.hypot(*way[:, [0, 2]].T) / NEXT, 0, 1)[:, None]
    color = np.where(far < 1, scenery.flat_colors[floor], scenery.flat_colors[wall])
    return np.asarray(world.white * color * (NEAR + (FAR - NEAR) * far), np.float32)


def _around(picture: np.ndarray, way: np.ndarray) -> np.ndarray:
    """(n, 3) linear colour of a picture by latitude and longitude in directions (n, 3)."""
    down = np.arccos(np.clip(way[:, 1], -1, 1)) / np.pi
    return between(picture, 0.5 + np.arctan2(way[:, 0], way[:, 2]) / (2 * np.pi), down)


class Hits(NamedTuple):
    """Where rays met something: points just before it, its normals, the ways back (n, 3) float32, and gloss (n,)."""

    point: np.ndarray
    normal: np.ndarray
    toward: np.ndarray
    gloss: np.ndarray


def _light(world: World, hits: Hits, sample: int, shift: np.ndarray) -> np.ndarray:
    """(n, 6) what falls on points by one sample of the sun, a window and a lamp, and what is around, see `_asked`."""
    light, sun = _direct(world, hits, *(_even(sample, part) for part in (shift[:, :2], shift[:, 2:])))
    dim = np.float32(DIM * max(world.scenery.lights.sky, 0.1)) * world.white / max(float(world.white @ LUMA), 1e-6)
    light = np.pad(light + dim, ((0, 0), (0, 1)))
    for ray in range(AROUND):
        light += _gathered(world, hits, _even(sample * AROUND + ray, shift[:, 2:])) / AROUND
    return np.column_stack([light[:, :3], _mirrored(world, hits, _even(sample, shift[:, :2])), light[:, 3], sun])


def _mirrored(world: World, hits: Hits, square: np.ndarray) -> np.ndarray:
    """(n,) how bright the windows, lamps and walls are that glossy points mirror to the eye, by `square` (n, 2)."""
    out, some = np.zeros(len(hits.point), np.float32), np.flatnonzero(hits.gloss > GLOSSY)
    point, normal, toward, gloss = (each.take(some, 0) for each in hits)
    facing, rough = np.clip(_dot(toward, normal), 0, 1), np.clip(1 - 2 * gloss, 0, 1)
    way = _unit(2 * facing[:, None] * normal - toward + (BLUR * rough**2)[:, None] * _on_sphere(square.take(some, 0)))
    hit, scenery = world.scene.run(_f32(point), _f32(way), output=1), world.scenery
    face = np.maximum(hit["primID"], 0)
    rows = world.thrown.rows(point, way, np.minimum(hit["tfar"], 100), scenery.axis.take(face))
    within = (world.thrown.radiance.take(rows, 0) + scenery.emissive.take(face, 0) * world.glow) @ LUMA
    sky = np.float32(VIEW * scenery.lights.sky) * np.clip(0.65 + 1.4 * way[:, 1], 0.3, 1)
    share = np.where(gloss > METAL, 1, 0.04 + (0.96 - rough) * (1 - facing) ** 5)  # Schlick's, of Fresnel's law
    out[some] = share * np.where(hit["primID"] < 0, sky, within)
    return out


def _direct(world: World, hits: Hits, spot: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, ...]:
    """(n, 3) what comes from windows and lamps, (n,) the sun's share.

    `spot`, `turn`: (n, 2) in [0, 1), which place in which window and lamp is asked.
    """
    scene, scenery = world.scene, world.scenery
    lights, point, normal, count = scenery.lights, hits.point, hits.normal, len(hits.point)
    light, inside = np.zeros((count, 3), np.float32), world.view.inside
    if inside and len(scenery.panes):  # one place in one window for each ray
        pane = scenery.panes[np.minimum((turn[:, 0] * len(scenery.panes)).astype(int), len(scenery.panes) - 1)]
        place = pane[:, 0] + (2 * spot[:, :1] - 1) * pane[:, 1] + (2 * spot[:, 1:] - 1) * pane[:, 2]
        way, away = way_to(point, place)
        area = np.cross(pane[:, 1], pane[:, 2])  # a quarter of it
        seen = np.clip(_dot(way, normal), 0, None) * 4 * np.abs(_dot(way, area)) / np.maximum(away, 0.2) ** 2
        seen *= np.clip(0.65 + 1.4 * way[:, 1], 0.3, 1)  # sky above, ground below
        share = free(scene, point, way, away, seen > 1e-4) * np.minimum(seen, 1.5)  # none a spark near a pane
        light += share[:, None] * (len(scenery.panes) * SKY * lights.sky / np.pi) * SKY_LIGHT * lights.tint
    if inside and len(lights.bulbs):  # one lamp for each ray
        which = np.minimum((turn[:, 1] * len(lights.bulbs)).astype(int), len(lights.bulbs) - 1)
        way, away = way_to(point, lights.bulbs[which, (spot[:, 0] * lights.bulbs.shape[1]).astype(int)])
        facing = np.clip(_dot(normal, way), 0, None) * len(lights.bulbs) / (away**2 + OWN**2)
        own = np.maximum(OWN, np.ptp(lights.bulbs, axis=1).max(-1))[which]  # what is so near is its shade
        lit = free(scene, point, way, away - own, facing > 0) * facing
        light += lit[:, None] * lights.power.take(which, 0) / np.float32(np.pi)
    return light, _sunny(world, point, normal, spot)


def _sunny(world: World, point: np.ndarray, normal: np.ndarray, spot: np.ndarray) -> np.ndarray:
    """(n,) float32 share of the sun that shines on points from a place of its disc, `spot` (n, 2) in [0, 1)."""
    sun, inside = world.scenery.lights.sun, world.view.inside
    if inside and (sun is None or not len(world.scenery.panes)):
        return np.zeros(len(point), np.float32)
    towards, soft = (sun[0], np.float32(0.005)) if inside and sun is not None else (ABOVE, SUN_SPREAD)
    towards = _unit(towards + soft * _on_sphere(spot))
    facing = np.clip(_dot(normal, towards), 0, None)
    return free(world.scene, point, towards, np.full(len(point), 1e3, np.float32), facing > 0) * facing


def _gathered(world: World, hits: Hits, square: np.ndarray) -> np.ndarray:
    """(n, 4) what surfaces throw on points by one ray each, which goes to `square` (n, 2), and shares of `CREVICE`."""
    way = _unit(hits.normal + _on_sphere(square))  # cosine-weighted
    other = world.scene.run(_f32(hits.point), _f32(way), output=1)
    axis = world.scenery.axis.take(other["primID"])
    rows = world.thrown.rows(hits.point, way, np.minimum(other["tfar"], 100), axis)
    thrown, missed = world.thrown.radiance.take(rows, 0), np.flatnonzero(other["primID"] < 0)
    thrown[missed] = 0 if world.view.inside else (0.92 + 0.35 * way.take(missed, 0)[:, 1:2]) * SKY_LIGHT
    pale = PALE * world.scenery.flat_colors.take(other["primID"], 0) @ LUMA
    return np.column_stack([thrown, pale + (1 - pale) * np.clip(other["tfar"] / CREVICE, 0, 1)])


def _lit(world: World) -> World:
    """A room that knows how bright its surfaces and shades are, and the mean light on them.

    Light is found at places that an eye in it and those places see, and thrown on `TURNS` times.
    """
    rng, normals = np.random.default_rng(0), world.scenery.normals[:, 0]
    point, normal = world.view.start[None].astype(np.float32), np.zeros((1, 3), np.float32)
    met: list[tuple[np.ndarray, ...]] = []
    for count in PLACES:  # from the eye all around or, where it is outside, ahead, then from what it sees
        origin, square = np.resize(point, (count, 3)), rng.random((count, 2), np.float32)
        way = _unit(np.resize(normal, (count, 3)) + _on_sphere(square))
        if not (met or world.view.inside):
            origin, way = _rays(world, *(square * (world.size, world.size / world.view.aspect)).T)
        hit = world.scene.run(_f32(origin), _f32(way), output=1)
        there = np.flatnonzero(hit["primID"] >= 0)
        origin, way, face, far = origin[there], way[there], hit["primID"][there], hit["tfar"][there]
        normal = -np.sign(_dot(normals[face], way))[:, None] * normals[face]
        point = origin + far[:, None] * way + BEFORE * normal
        rows = world.thrown.rows(origin, way, far, world.scenery.axis[face])
        met.append((point, normal, rows, world.scenery.flat_colors[face]))
        if not len(there):
            return world  # with nothing in the picture
    point, normal, rows, albedo = (np.concatenate(values) for values in zip(*met, strict=True))
    hits = Hits(point, normal, normal, np.zeros(len(point), np.float32))
    direct, light = np.zeros_like(point), np.zeros_like(point)
    for _ in range(OFTEN):
        some, sun = _direct(world, hits, *rng.random((2, len(point), 2), np.float32))
        direct += (some + sun[:, None] * world.sun) / OFTEN
    for _ in range(TURNS):
        world = world._replace(thrown=world.thrown.lit(rows, albedo * (direct + light)))
        squares = rng.random((OFTEN, len(point), 2), np.float32)
        light = np.mean([_gathered(world, hits, square)[:, :3] for square in squares], 0)
    white, emissive = (direct + light).mean(0), world.scenery.emissive
    # shades of the room's whole colour would be yellower than what they light
    tinted = white**0.8 * (white @ LUMA) ** 0.2
    glow = np.interp(world.scenery.lights.day, (0, 1), GLOWING) * tinted / float((emissive @ LUMA).max(initial=1e-6))
    return world._replace(glow=glow.astype(np.float32), white=white)


def way_to(point: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) from points to places, and how far they are, (n,) metres."""
    way = place - point
    away = np.sqrt(np.maximum(_dot(way, way), 1e-12))
    return way / away[:, None], away


def free(scene: Any, point: np.ndarray, way: np.ndarray, away: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """(n,) float32: 1 where nothing stands within `away` metres in a direction, 0 elsewhere and where not `asked`."""
    out, ask = np.zeros(len(point), np.float32), np.flatnonzero(asked & (away > 0.02))
    out[asked & (away <= 0.02)] = 1.0
    if len(ask):
        far = np.ascontiguousarray(away[ask] - 0.01, np.float32)
        out[ask] = scene.run(_f32(point.take(ask, 0)), _f32(way.take(ask, 0)), dists=far, query="OCCLUDED") != 0
    return out


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return along(np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.sqrt(np.maximum(_dot(vectors, vectors), 1e-18))[:, None]


def _even(number: int, shift: np.ndarray) -> np.ndarray:
    """Point `number` of the R2 sequence, which fills the unit square evenly, moved by a shift per pixel."""
    moved = shift + R2 * (number + 1) % 1.0
    return moved - np.floor(moved)  # four times as fast as a remainder


def _on_sphere(square: np.ndarray) -> np.ndarray:
    """Points of the unit square, spread evenly over the unit sphere."""
    height = 2 * square[:, 0] - 1
    radius, angle = np.sqrt(np.clip(1 - height**2, 0, 1)), 2 * np.pi * square[:, 1]
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], 1)


def _f32(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)
