"""Light in a picture: rays through Embree, soft sun, occluded sky, what surfaces throw on, the noise smoothed away."""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from PIL import Image, ImageFilter

from echomodel.late import lates
from echomodel.triangles import along, area_normals, cross, unit
from echousd.draw.contact import Contact
from echousd.draw.indoors import DIM, GLOWING, LUMA, OWN, RIM, SUN, Bounced, evened, exposure, rolled
from echousd.draw.rays import BLOCK, Seen, World, camera_rays, embree, even, first_hit, free, on_sphere, shifts, way_to
from echousd.draw.scenery import CLOTH, SKY_LIGHT, Scenery, next_room, outside
from echousd.draw.smoothing import RINGS, same_surface, smooth_light
from echousd.draw.views import View

# What only fine pictures show is not loaded for others.
slanted, turned, tilted = lates("echousd.draw.relief", "slanted", "turned", "tilted")
FINE, QUICK = 3, 2  # squared: rays per pixel
SHARPER = 0.6  # of how a pixel within a surface differs from those around it: grain and weave are seen from afar
AROUND = 2  # per ray: rays to what stands around
# Places at which a room's light is found, rays of each kind from each, and how often light is thrown on.
PLACES, OFTEN, TURNS = (600, 1200), 3, 5
# Metres from which on what stands near throws on all of its light, which is in a shadow itself, and of how much it
# throws on more if it is white; what any surface mirrors of all around it.
CREVICE, PALE, SHEEN = 1.0, 0.55, 0.05
# Light at ceilings, which photographers of rooms throw: its share of the mean, and metres below them that it reaches.
THROWN, UPPERMOST = np.float32(0.25), 0.35
# In fine pictures: metres within which what is met throws on what falls just there; factors that make of a place of the
# unit square others that hardly depend on it, for the rays from there; share of the width on either side of an edge in
# which light is asked more often and smoothed less, as shadows of feet are small.
NEAR, SCATTERED, BAND = np.float32(0.5), (np.float32(1021), np.float32(769)), 0.004
# Gloss from which on surfaces mirror, and are metal, of which so much is not mirrored; how far from where a mirror
# would a rough one mirrors.
GLOSSY, METAL, MATT, BLUR = 0.2, 0.5, 0.4, 0.6
SUNNY = 2.0  # of the mean light in a room: at most what the sun gives, as if blended in from darker exposures
WASHED = 0.25  # how much less coloured a shade is that a bulb shines through
HALO = (0.02, 0.2)  # width, of the picture's, over which what shines is spread, and the share of it
GLINT = 1.2  # of the mean light: at most what rough surfaces mirror of a lamp, whose noise looks like smoke


def trace(scenery: Scenery, view: View, size: int, *, rays: int = FINE, seed: int = 0) -> np.ndarray:
    """The picture as (size / aspect, size, 3) float sRGB in [0, 1].

    Pixels at edges send `rays`² rays, others one. Light is asked at every second pixel of every second row, twice
    `rays` times at edges, thrice around them if fine, else (`rays` - 1)² times. What asks covers the sun's disc and the
    sky evenly, each pixel with another shift (randomised quasi-Monte Carlo), so that little noise is left.

    `scenery`: triangles and their colours. `view`: the camera; inside a room its windows and lamps light it, else sun
    and sky from above. `size`: pixels across. `rays`: along each side of a pixel. `seed`: of the shifts; the same seed
    gives the same picture.
    """
    height = round(size / view.aspect)
    shift, sun = np.random.default_rng(seed).random(4), scenery.lights.sun
    sun = np.float32(SUN / np.pi) * (0 * SUN_LIGHT if sun is None else sun[1]) if view.inside else 0.55 * SUN_LIGHT
    dark = Bounced.dark(*scenery.bounds)
    world = World(embree(scenery.triangles), scenery, view, size, shift, dark, sun, rays >= FINE)
    return _drawn(_lit(world), height, rays).transpose(1, 2, 0) ** np.float32(1 / 2.2)


def _drawn(world: World, height: int, rays: int) -> np.ndarray:
    """(3, height, size) linear colours of the picture, of each ray as it is shown: so edges of what glares are even."""
    size, many = world.size, rays**2
    step = np.arange(many)
    places = np.stack([(3 * (step + 1) % (many + 1) - 0.5) / many, (step + 0.5) / many])
    _, seen = _met(world, np.arange(height * size), places[:, :1])
    near = _at_edges(world, seen, (height, size))
    pixel = np.flatnonzero(near)
    pixel, more = _met(world, np.tile(pixel, many - 1), places[:, 1:].repeat(len(pixel), 1), seen)
    edge = np.bincount(pixel, minlength=height * size) > 0
    light = _light_of(world, seen, near, edge, 2 * rays, max(1, (rays - 1) ** 2))
    world = world._replace(atlas=world.scenery.atlas(seen.face, _breadth(world, seen), world.fine))
    color = _colored(world, seen, light)
    met = seen.face >= 0
    lamps = met & world.scenery.planes.glows.take(seen.face)
    own = np.flatnonzero(met & ~lamps)[::4]  # which tell as well how bright it is
    tone = exposure(color.take(own, 1) if len(own) else color, world.white, world.scenery.lights.day)
    tone = tone if world.view.inside else rolled
    color = _blended(seen, color, tone)
    halo = _halo((color * (lamps | (seen.shown == 1))).reshape(3, height, size))
    finer = _colored(world, more, _lent(world, more, pixel, seen, light))
    finer = _blended(more, finer, tone) - color.take(pixel, 1)
    color += np.stack([np.bincount(pixel, part / many, len(edge)) for part in finer])
    color = color.reshape(3, height, size)
    wide = np.pad(color, ((0, 0), (1, 1), (1, 1)), mode="edge")  # of an edge's pixel each neighbour takes an eighth
    rows = wide[:, 1:-1] * 0.75 + (wide[:, :-2] + wide[:, 2:]) * 0.125
    soft = rows[..., 1:-1] * 0.75 + (rows[..., :-2] + rows[..., 2:]) * 0.125
    color = np.where(edge.reshape(height, size), soft, np.clip(color + np.float32(SHARPER) * (color - soft), 0, 1))
    return color + halo * (1 - color)


def _halo(color: np.ndarray) -> np.ndarray:
    """(3, height, size) what lenses and eyes spread of what shines, as it is shown, over all around it, see `HALO`."""
    wide, share = HALO
    image = Image.fromarray((np.clip(color, 0, 1) * 255).astype(np.uint8).transpose(1, 2, 0)).reduce(4)
    image = image.filter(ImageFilter.GaussianBlur(wide * image.width)).resize(color.shape[:0:-1])
    return np.float32(share / 255) * np.asarray(image).transpose(2, 0, 1)


def _blended(seen: Seen, color: np.ndarray, tone: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """(3, n) radiance as a picture shows it, and over it the share of what lies around."""
    color, through = tone(color), np.flatnonzero(seen.shown)
    color[:, through] += seen.shown.take(through) * (seen.glow.take(through, 1) - color.take(through, 1))
    return color


# Pixels to the right and down, near ones first.
BESIDE = np.array(sorted(product(range(-2, 3), repeat=2), key=lambda at: at[0] ** 2 + at[1] ** 2)[:13])
POOL, CORNERS = (0.15, 0.05), np.array(list(product((0, 1), repeat=3)))  # metres; of a cell of these
# metres before a surface, from where on it is no more in the way of its own light; and of what cloth is thick
BEFORE, THICK = np.float32(2e-3), np.float32(0.016)
# Of thin cloth before a pane: metres behind it where one begins to see, the share of what is there, the power of the
# cosine by which that is less aside.
BEHIND, SEEN_BY, CLOSER = 0.05, 0.42, 6
MIRROR, DYED = 0.8, 0.4  # gloss of what mirrors like glass with silver behind it; by the square of how coloured it is
# Of glass that one looks through: sheets at most, its colour, how bright is what it mirrors aside and more of what is
# above, the share of that straight on, aslant it is more; by which shares differ at an edge; more if it is coloured.
SHEETS, TINT, MIRRORED, CLEAR, EDGE = 12, np.array([[0.84], [0.94], [0.92]], "f4"), (0.32, 0.58), 0.04, 0.12


def _met(world: World, pixel: np.ndarray, place: np.ndarray, first: Seen | None = None) -> tuple[np.ndarray, Seen]:
    """What is seen in some pixels, right and down in each by `place` (2, n) or, in all alike, (2, 1), and in which.

    Where `first` tells what was seen in each pixel already: only what is another surface or material.
    """
    found: list[tuple[np.ndarray, Seen]] = []
    for start in range(0, max(len(pixel), 1), BLOCK):
        here = slice(start, start + BLOCK)
        rows, (right, below) = pixel[here], np.broadcast_to(place, (2, len(pixel)))[:, here]
        down, across = np.divmod(rows, world.size)
        origin, way = camera_rays(world, across + right, down + below)
        hit: Sequence[np.ndarray] = first_hit(world, origin, way)
        if first is not None:
            before = first.of(rows)
            new = np.flatnonzero((hit[0] != before.face) | ((before.shown > 0) & (before.face >= 0)))
            origin, way, rows, *hit = (each.take(new, -1) for each in (origin, way, rows, *hit))
        part, veil = _seen(world, origin, way, hit), np.zeros((4, len(rows)), np.float32)
        for glass in (True,) * SHEETS + (False,):  # through it one sees what is behind, in a mirror what is before
            looks = world.scenery.thin.take(part.face) == 1 if glass else world.scenery.gloss.take(part.face) > MIRROR
            some = np.flatnonzero(looks & (part.face >= 0))
            if not len(some):
                continue
            on, normal = way.take(some, 1), part.normal.take(some, 1)
            facing = along(on, normal)
            if glass:
                tint = world.scenery.flat_colors.take(part.face.take(some), 0).T
                tint /= np.maximum(tint.max(0), np.float32(1e-6))
                above = np.clip(on[1] - 2 * facing * normal[1], 0, 1)
                color = np.insert(TINT * tint * (MIRRORED[0] + MIRRORED[1] * above), 3, 1, axis=0)
                share = CLEAR + DYED * (1 - tint.min(0)) ** 2
                veil[:, some] += (1 - veil[3, some]) * (share + (1 - share) * (1 + facing) ** 3) * color
            on = on if glass else on - 2 * facing * normal
            origin = part.point.take(some, 1) + BEFORE * (on if glass else normal)
            for own, other in zip(part, _seen(world, origin, on, first_hit(world, origin, on)), strict=True):
                own[..., some] = other
        some = np.flatnonzero(veil[3])
        veil, behind = veil[:, some], (1 - veil[3, some]) * part.shown[some]
        part.shown[some] = veil[3] + behind
        part.glow[:, some] = (veil[:3] + behind * part.glow[:, some]) / part.shown[some]
        if first is not None:
            differs = np.flatnonzero(_other(world, part, first.of(rows)))
            part, rows = part.of(differs), rows.take(differs)
        found.append((rows, part))
    pixels, parts = zip(*found, strict=True)
    return np.concatenate(pixels), Seen(*(np.concatenate(each, -1) for each in zip(*parts, strict=True)))


def _other(world: World, one: Seen, two: Seen) -> np.ndarray:
    """(n,) bool: what is another surface or material."""
    material = world.scenery.planes.material
    same = same_surface(one.normal, one.point, two.normal, two.point)
    return (material.take(one.face) != material.take(two.face)) | ~same | (np.abs(one.shown - two.shown) > EDGE)


def _at_edges(world: World, seen: Seen, shape: tuple[int, int]) -> np.ndarray:
    """(n,) bool of a picture's pixels: whether another surface is seen beside them, or beside their neighbours."""
    values, out = [value.reshape(*value.shape[:-1], *shape) for value in seen], np.zeros(shape, bool)
    for one, two in ((np.s_[..., :-1], np.s_[..., 1:]), (np.s_[..., :-1, :], np.s_[..., 1:, :])):
        differs = _other(world, *(Seen(*(value[part] for value in values)) for part in (one, two)))
        out[one] |= differs
        out[two] |= differs
    wide = np.pad(out, 1)
    return (out | wide[2:, 1:-1] | wide[:-2, 1:-1] | wide[1:-1, 2:] | wide[1:-1, :-2]).ravel()


def _seen(world: World, origin: np.ndarray, way: np.ndarray, hit: Sequence[np.ndarray]) -> Seen:
    """What rays met, of what `first_hit` says of them."""
    scenery, (face, far, (u, v)) = world.scenery, hit
    missed, count = np.flatnonzero(face < 0), len(face)
    glow, shown = np.zeros((3, count), np.float32), np.zeros(count, np.float32)
    begin, towards = origin.take(missed, 1), way.take(missed, 1)
    glow[:, missed], through = outside(scenery, begin, towards)
    if world.view.inside:
        glow[:, missed] = scenery.lights.there(glow[:, missed])
        shown[missed], past = through, np.flatnonzero(~through)
        glow[:, missed[past]] = next_room(scenery, world.white, begin.take(past, 1), towards.take(past, 1))
    lean = scenery.planes.normal.take(face, 1)
    normal = unit(lean[:3] + u * lean[3:6] + v * lean[6:])
    averted = np.flatnonzero(along(normal, way) > 0)  # seen from behind, or at a rim whose round normals look away
    flat = area_normals(scenery.triangles[face[averted]]).T
    normal[:, averted] *= -np.copysign(np.float32(1), along(flat, normal[:, averted]) * along(flat, way[:, averted]))
    seen = Seen(face, origin + far * way, normal, hit[2], glow, shown)
    if world.view.inside:
        _see_through(world, way, seen)
    return seen


def _see_through(world: World, way: np.ndarray, seen: Seen) -> None:
    """Tell of thin cloth before a pane, which rays (3, n) met, what is around behind it; where its folds turn aside it
    is closer, and before bars and boards, which would look like stains, alone."""
    scenery = world.scenery
    sheer = np.flatnonzero((scenery.thin.take(seen.face) > CLOTH) & (seen.face >= 0))
    if not len(sheer):
        return
    way = way.take(sheer, 1)
    point, facing = seen.point.take(sheer, 1) + BEHIND * way, np.abs(along(way, seen.normal.take(sheer, 1)))
    around, through = outside(scenery, point, way)
    behind = first_hit(world, point, way)[0]
    open_ = (behind < 0) | (scenery.thin.take(behind) > 0)
    seen.glow[:, sheer] = scenery.lights.there(around)
    seen.shown[sheer] = SEEN_BY * (through & open_) * facing**CLOSER


def _asked(world: World, seen: Seen, pixel: np.ndarray, samples: int) -> np.ndarray:
    """(rows, n) what falls on what was seen in some pixels: soft light by colour, what is mirrored to the eye, and the
    share of the sun that shines there; in fine pictures how soft light grows, see `slanted`."""
    out = np.zeros((world.rows, len(pixel)), np.float32)
    for here, part in seen.blocks():
        part, shift = part._replace(point=part.point + BEFORE * part.normal), shifts(world, pixel[here])
        for sample in range(samples):
            out[:, here] += _light(world, part, sample, shift)
    return out / np.float32(samples)


def _light_of(world: World, seen: Seen, near: np.ndarray, edge: np.ndarray, often: int, seldom: int) -> np.ndarray:
    """(rows, n) light at all pixels: asked at every second of every second row, lent to those of the same surface.

    Where there is little of a surface around to smooth the light over, at an `edge` (n,), it is asked `often`, and what
    is `near` one (n,) shares it by place: trims a pixel wide have no neighbours in rows and columns.
    """
    shape = len(seen.face) // world.size, world.size
    met, coarse, inside = seen.face.reshape(shape) >= 0, np.s_[..., ::2, ::2], world.view.inside
    normal, point = (each.reshape(3, *shape) for each in (seen.normal, seen.point))
    asked, torn, number = met[coarse], edge.reshape(shape)[coarse], np.arange(met.size).reshape(shape)[coarse]
    found = np.zeros((world.rows + 1, asked.size), np.float32)  # the last: whether the sun shines
    known = [normal[coarse].copy(), point[coarse].copy()]
    share = np.zeros_like(torn, np.float32)  # of what is smoothed less, as light changes from place to place there
    if world.fine:
        wide, band = Image.fromarray(np.where(torn, np.uint8(255), np.uint8(0))), round(BAND * world.size)
        wide = wide.filter(ImageFilter.MaxFilter(2 * band + 1)).filter(ImageFilter.BoxBlur(band))
        share = np.asarray(wide, np.float32) / np.float32(255)
        torn, often = share > 0, often * 3 // 2
    for here, times in ((asked & torn, often), (asked & ~torn, seldom)):
        found[:-1, here.ravel()] = _asked(world, seen.of(number[here]), number[here], times)
    thin = np.flatnonzero(asked & near.reshape(shape)[coarse])
    raw, slim = found[:-1, thin], number.ravel()[thin]
    smooth = np.arange(world.rows) != 4
    found[np.ix_(np.flatnonzero(smooth), thin)] = _pooled(seen.of(slim), raw[smooth], world.fine)
    found[-1] = found[4] > 0
    gloss = world.scenery.gloss.take(seen.face).reshape(shape)[coarse]
    reach = (
        (np.s_[:3], RINGS[:3]), (np.s_[3:4], RINGS, gloss), (np.s_[4:5], RINGS[:1] if inside else RINGS),
        (np.s_[5:-1], RINGS[:3] if world.fine else ()), (np.s_[-1:], RINGS[:1]),
    )  # fmt: skip
    found = smooth_light(found.reshape(-1, *asked.shape), known[0], known[1], reach)
    far = ((np.s_[:3], RINGS[3:]), (np.s_[5:-1], RINGS[3:] if world.fine else ()))
    found += (1 - share) * (smooth_light(found.copy(), known[0], known[1], far) - found)
    mixed = ((found[-1] > 0.01) & (found[-1] < 0.99)).repeat(2, 0).repeat(2, 1)[: shape[0], : shape[1]]
    light, weight = np.zeros((world.rows, *shape), np.float32), np.zeros(shape, np.float32)
    there, *known, found = (
        np.pad(each, [(0, 0)] * (each.ndim - 2) + [(0, 1)] * 2, "edge") for each in (asked, *known, found[:-1])
    )
    for odd in product((0, 1), repeat=2):  # of the one, two or four that were asked around it, those of its own surface
        here = np.s_[..., odd[0] :: 2, odd[1] :: 2]
        own = normal[here].copy(), point[here].copy()
        many, lent = weight[here].copy(), light[here].copy()
        for down, right in product(*(range(each + 1) for each in odd)):
            beside = np.s_[..., down : down + many.shape[0], right : right + many.shape[1]]
            fits = there[beside] & same_surface(*own, *(each[beside] for each in known)) if any(odd) else there[beside]
            lent += fits * found[beside]
            many += fits
        light[here], weight[here] = lent / np.maximum(many, 1), many
    rest, flat = np.flatnonzero(met & (weight == 0)), light.reshape(world.rows, -1)
    # with what was asked of slim things beside them: alone they would be lighter and darker dashes along a trim
    more = np.concatenate([_asked(world, seen.of(rest), rest, often // 2), raw], 1)
    flat[:, rest] = _pooled(seen.of(np.concatenate([rest, slim])), more, world.fine)[:, : len(rest)]
    border = np.flatnonzero(met & mixed & inside)  # of the sun's light: sharper than two pixels
    facing, shift = seen.normal.take(border, 1), shifts(world, border)[:2]
    there = seen.point.take(border, 1) + BEFORE * facing
    flat[4, border] = np.mean([_sunny(world, there, facing, even(n, shift)) for n in range(often)], 0)
    return smooth_light(light, normal, point, ((np.s_[:], RINGS[:1]),)).reshape(world.rows, -1)


def _pooled(seen: Seen, light: np.ndarray, fine: bool) -> np.ndarray:
    """(c, n) light on what was seen: its mean over what faces the same way within `POOL` metres, the nearer the more.

    Places lie between the corners of cells, which they add their light to, and take the mean from.
    """
    place = seen.point / np.float32(POOL[fine])
    low = np.floor(place)
    cell = (1 << np.arange(48, 0, -8)) @ np.concatenate([low, np.rint(2 * seen.normal) + 2]).astype(np.int64)
    share = np.stack([1 + low - place, place - low])
    weight = np.stack([share[x, 0] * share[y, 1] * share[z, 2] for x, y, z in CORNERS])
    cells, own = np.unique(cell, return_inverse=True)  # many places are in one
    _, number = np.unique(cells + CORNERS @ (1 << np.array([48, 40, 32]))[:, None], return_inverse=True)
    corner = np.asarray(number.reshape(len(CORNERS), -1).take(own, 1))
    held = np.stack([np.bincount(corner.ravel(), (weight * part).ravel()) for part in (np.ones(len(cell)), *light)])
    taken = (held.take(corner, 1) * weight).sum(1)
    return np.asarray(taken[1:] / np.maximum(taken[0], 1e-9), np.float32)


def _lent(world: World, more: Seen, pixel: np.ndarray, seen: Seen, light: np.ndarray) -> np.ndarray:
    """(rows, n) light of what further rays in some pixels met: that of their surface there or beside it, else asked."""
    out, wanted = np.zeros((world.rows, len(pixel)), np.float32), np.flatnonzero(more.face >= 0)
    for apart in BESIDE @ (1, world.size):
        other = np.clip(pixel.take(wanted) + apart, 0, light.shape[1] - 1)
        own = more.normal.take(wanted, 1), more.point.take(wanted, 1)
        fits = (seen.face.take(other) >= 0) & same_surface(*own, seen.normal.take(other, 1), seen.point.take(other, 1))
        out[:, wanted[fits]] = light.take(other[fits], 1)
        wanted = wanted[~fits]
    rest, pixel = more.of(wanted), pixel[wanted]
    out[:, wanted] = _pooled(rest, _asked(world, rest, pixel, 1), world.fine)
    return out


def _colored(world: World, everything: Seen, falling: np.ndarray) -> np.ndarray:
    """(3, n) radiance of what was seen in light (rows, n)."""
    scenery, out, sun, inside = world.scenery, np.empty_like(everything.glow), world.sun[:, None], world.view.inside
    for here, seen in everything.blocks():
        light = falling[:, here]
        looks = seen.face, seen.bary, _breadth(world, seen), world.atlas
        color, soft = scenery.colors(*looks), light[:3] * world.contact.left(seen.point, seen.normal)
        if inside:
            upper = seen.point[1] > scenery.bounds[1][1] - UPPERMOST
            soft += THROWN * world.white[:, None].astype("f4") * np.clip(-seen.normal[1], 0, upper)
        shone = light[4] * sun
        if world.fine:
            share, steep = tilted(soft, light[5:], world.towards, seen.normal, turned(scenery, seen.normal, *looks))
            soft, shone = soft * share, shone * steep
        fallen = evened(soft + (not inside) * shone, world.white, inside) + inside * shone
        color += np.float32(SHEEN) * (1 - color)
        metal = scenery.gloss.take(seen.face) > METAL
        mirrored = light[3] * world.tint * np.where(metal, color, 1)
        out[:, here] = color * fallen * np.where(metal, np.float32(MATT), 1) + mirrored
        if len(shade := np.flatnonzero(scenery.planes.glows.take(seen.face))):  # less what they throw on themselves
            bright = scenery.emissive.take(seen.face.take(shade), 0).T
            bright += np.float32(WASHED) * (LUMA @ bright - bright) + light[3, shade]
            out[:, here.start + shade] = bright * world.glow[:, None] * _through(world, seen.of(shade))
        missed = np.flatnonzero(seen.face < 0)
        out[:, here.start + missed] = seen.glow.take(missed, 1)
    return out


def _through(world: World, seen: Seen) -> np.ndarray:
    """(n,) in [0, 1] how much of a lamp's light comes through its shade: most at the bulb, little at its rim."""
    back, bulbs = unit(world.view.matrix[:3, 3:].astype("f4") - seen.point), world.scenery.lights.bulbs.mean(1)
    share = np.clip(along(back, seen.normal), 0, 1)
    if len(bulbs):
        away = seen.point[:, None] - bulbs.T[:, :, None]
        share *= along(unit(away[:, along(away, away).argmin(0), np.arange(len(share))]), seen.normal) ** 2
    return np.asarray(RIM + (1 - RIM) * share)


def _breadth(world: World, seen: Seen) -> np.ndarray:
    """(n,) metres of what was seen that a pixel shows, the mean of both ways over it."""
    back = world.view.matrix[:3, 3:].astype(np.float32) - seen.point
    away = np.sqrt(np.maximum(along(back, back), np.float32(1e-9)))
    slant = np.clip(along(back, seen.normal) / away, 0.05, 1)
    return np.asarray(2 * world.view.half / world.size * (away / np.sqrt(slant)) ** (not world.view.orthographic))


SUN_SPREAD = (0.10, 0.015)  # radius of the sun's disc at distance 1, outside and, as if in haze, inside: soft shadows
SUN_LIGHT = np.array([1.05, 0.99, 0.90], np.float32)


def _light(world: World, seen: Seen, sample: int, shift: np.ndarray) -> np.ndarray:
    """(rows, n) what falls on points by one sample of the sun, a window and a lamp, and what is around: `_asked`."""
    out, at = np.zeros((world.rows, len(seen.face)), np.float32), (seen.point, seen.normal)
    spots = [even(sample, part) for part in (shift[:2], shift[2:])]
    soft, out[4] = _direct(world, *at, *spots)
    share = world.scenery.thin.take(seen.face)
    if len(cloth := np.flatnonzero(share)):  # which light comes through
        point, normal, *spots = (each.take(cloth, 1) for each in (*at, *spots))
        soft[:3, cloth] += share.take(cloth) * _fallen(world, point - THICK * normal, -normal, *spots)
    for ray in range(AROUND):
        soft += _gathered(world, *at, even(sample * AROUND + ray, shift[2:])) / AROUND
    out[:3] = soft[:3] + np.float32(DIM * max(world.scenery.lights.sky, 0.1)) * world.tint
    out[3], out[5:] = _mirrored(world, seen, even(sample, shift[:2])), soft[3:]
    return out


def _mirrored(world: World, seen: Seen, square: np.ndarray) -> np.ndarray:
    """(n,) how bright the windows, lamps and walls are that glossy points mirror to the eye, by `square` (2, n)."""
    scenery, eye = world.scenery, world.view.matrix[:3, :, None].astype(np.float32)
    gloss = scenery.gloss.take(seen.face)
    out, some = np.zeros(len(gloss), np.float32), np.flatnonzero(gloss > GLOSSY)
    point, normal, gloss = (each.take(some, -1) for each in (seen.point, seen.normal, gloss))
    toward = unit(eye[:, 2] + 0 * point if world.view.orthographic else eye[:, 3] - point)
    facing, rough = np.clip(along(toward, normal), 0, 1), np.clip(1 - 2 * gloss, 0, 1)
    way = unit(2 * facing * normal - toward + BLUR * rough**2 * on_sphere(square.take(some, 1)))
    face, far, _ = first_hit(world, point, way)
    rows = world.thrown.rows(point, way, far, scenery.planes.axis.take(face))
    within = LUMA @ world.thrown.radiance.take(rows, 1)
    bright = np.flatnonzero(scenery.planes.glows.take(face))
    lamps = (scenery.emissive.take(face[bright], 0) * world.glow) @ LUMA
    within[bright] += np.minimum(lamps, np.float32(GLINT) * (world.white @ LUMA))
    share = np.where(gloss > METAL, 1, 0.04 + (0.96 - rough) * (1 - facing) ** 5)  # Schlick's, of Fresnel's law
    out[some] = share * np.where(face < 0, LUMA @ scenery.lights.from_sky(way), within)
    return out


def _direct(
    world: World, point: np.ndarray, normal: np.ndarray, spot: np.ndarray, turn: np.ndarray
) -> tuple[np.ndarray, ...]:
    """(3, n) what comes from windows and lamps, if fine as `slanted` has it; (n,) the sun's share.

    `spot`, `turn`: (2, n) in [0, 1), which place in which window and lamp is asked.
    """
    scenery, lights = world.scenery, world.scenery.lights
    light, inside = np.zeros((world.rows - 2, point.shape[1]), np.float32), world.view.inside
    panes, panels = scenery.panes.reshape(-1, 9).T, lights.panels.reshape(-1, 12).T
    for flat in (panes, panels) if inside else ():  # one place in one window and in one panel for each ray
        if not (many := flat.shape[1]):
            continue
        which = np.minimum((turn[0] * many).astype(int), many - 1)
        plane, (u, v) = flat.take(which, 1), spot if flat is panes else (turn[0] * many - which, turn[1])
        way, away = way_to(point, plane[:3] + (2 * u - 1) * plane[3:6] + (2 * v - 1) * plane[6:9])
        outwards = along(way, cross(plane[3:6].T, plane[6:9].T).T)  # for a quarter of its area
        outwards = np.abs(outwards) if flat is panes else np.maximum(outwards, 0)
        seen = np.clip(along(way, normal), 0, None) * 4 * outwards / np.maximum(away, 0.2) ** 2
        share = free(world.tree, point, way, away, seen > 1e-4) * np.minimum(seen, 1.5)  # none a spark near a pane
        share = share * np.float32(many / np.pi) * (lights.from_sky(way) if flat is panes else plane[9:])
        light += slanted(share, way, normal) if world.fine else share
    if inside and len(lights.bulbs):  # one lamp for each ray
        which = np.minimum((turn[1] * len(lights.bulbs)).astype(int), len(lights.bulbs) - 1)
        way, away = way_to(point, lights.bulbs[which, (spot[0] * lights.bulbs.shape[1]).astype(int)].T)
        facing = np.clip(along(normal, way), 0, None) * len(lights.bulbs) / (away**2 + OWN**2)
        own = np.maximum(OWN, np.ptp(lights.bulbs, axis=1).max(-1))[which]  # what is so near is its shade
        lit = free(world.tree, point, way, away - own, facing > 0) * facing / np.float32(np.pi)
        share = lit * lights.shining.T.take(which, 1)
        light += slanted(share, way, normal) if world.fine else share
    return light, _sunny(world, point, normal, spot)


def _sunny(world: World, point: np.ndarray, normal: np.ndarray, spot: np.ndarray) -> np.ndarray:
    """(n,) float32 share of the sun that shines on points from a place of its disc, `spot` (2, n) in [0, 1)."""
    sun, inside = world.scenery.lights.sun, world.view.inside
    if inside and (sun is None or not len(world.scenery.panes)):
        return np.zeros(point.shape[1], np.float32)
    towards = unit(world.towards + np.float32(SUN_SPREAD[inside]) * on_sphere(spot))
    facing = np.clip(along(normal, towards), 0, None)
    return free(world.tree, point, towards, np.full(len(facing), 1e3, np.float32), facing > 0) * facing


def _fallen(world: World, *at: np.ndarray) -> np.ndarray:
    """(3, n) what comes from windows, lamps and the sun to points, as `_direct` takes them."""
    soft, sun = _direct(world._replace(fine=False), *at)
    return np.asarray(soft + sun * world.sun[:, None])


def _gathered(world: World, point: np.ndarray, normal: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(3, n) what surfaces throw on points by one ray each, which goes to `square` (2, n), see `CREVICE`; if fine as
    `slanted` has it, and what is met within `NEAR` metres throws on what falls just there, not on what does around."""
    way = unit(normal + on_sphere(square))  # cosine-weighted
    face, far, _ = first_hit(world, point, way)
    rows = world.thrown.rows(point, way, far, world.scenery.planes.axis.take(face))
    thrown, missed = world.thrown.radiance.take(rows, 1), np.flatnonzero(face < 0)
    thrown[:, missed] = 0 if world.view.inside else (0.92 + 0.35 * way[1].take(missed)) * SKY_LIGHT[:, None]
    thin = (world.scenery.thin.take(face) > 0) | (face < 0)  # light comes through
    pale, full = PALE * world.scenery.planes.luma.take(face), np.where(thin, np.float32(CREVICE), far)
    thrown *= pale + (1 - pale) * np.minimum(full / np.float32(CREVICE), 1)
    if not world.fine:
        return thrown
    near = np.flatnonzero((full < NEAR) & world.view.inside)
    face, far = face.take(near), far.take(near)
    there, facing = _before(world, point.take(near, 1), way.take(near, 1), (face, far))
    first, second = (square.take(near, 1) * scale % 1 for scale in SCATTERED)
    light = _fallen(world, there, facing, first, second)
    light += _gathered(world._replace(fine=False), there, facing, second[::-1])
    thrown[:, near] = world.scenery.planes.color.take(face, 1) * light
    return slanted(thrown, way, normal)


def _before(world: World, origin: np.ndarray, way: np.ndarray, hit: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    """Points (3, n) just before what rays `hit`, face and metres, and normals towards where these came from."""
    face, far = hit
    normal = world.scenery.planes.normal[:3].take(face, 1)
    normal *= -np.sign(along(normal, way))
    return origin + far * way + BEFORE * normal, normal


def _lit(world: World) -> World:
    """A room that knows how bright its surfaces and shades are, and the mean light on them.

    Light is found at places that an eye in it and those places see, and thrown on `TURNS` times.
    """
    world = world._replace(contact=Contact(world.scenery))
    rng, coarse = np.random.default_rng(0), world._replace(fine=False)
    point, normal = world.view.start[:, None].astype(np.float32), np.zeros((3, 1), np.float32)
    met: list[tuple[np.ndarray, ...]] = []
    for count in PLACES:  # from the eye all around or, where it is outside, ahead, then from what it sees
        origin, square = point.take(np.arange(count) % point.shape[1], 1), rng.random((count, 2), np.float32).T
        way = unit(normal.take(np.arange(count) % normal.shape[1], 1) + on_sphere(square))
        if not (met or world.view.inside):
            origin, way = camera_rays(world, world.size * square[0], world.size / world.view.aspect * square[1])
        face, far, _ = first_hit(world, origin, way)
        there = np.flatnonzero(face >= 0)
        origin, way, face, far = (each.take(there, -1) for each in (origin, way, face, far))
        point, normal = _before(world, origin, way, (face, far))
        rows = world.thrown.rows(origin, way, far, world.scenery.planes.axis[face])
        met.append((point, normal, rows, world.scenery.planes.color.take(face, 1)))
        if not len(there):
            return world  # with nothing in the picture
    point, normal, rows, albedo = (np.concatenate(values, -1) for values in zip(*met, strict=True))
    often = np.tile(point, OFTEN), np.tile(normal, OFTEN)
    spots = rng.random((OFTEN, 2, len(rows), 2), np.float32).transpose(1, 3, 0, 2).reshape(2, 2, -1)
    direct = _fallen(world, *often, *spots).reshape(3, OFTEN, -1).mean(1)
    light = np.zeros_like(point)
    for _ in range(TURNS):
        coarse = coarse._replace(thrown=coarse.thrown.lit(rows, albedo * (direct + light)))
        squares = rng.random((OFTEN, len(rows), 2), np.float32).transpose(2, 0, 1).reshape(2, -1)
        light = _gathered(coarse, *often, squares).reshape(3, OFTEN, -1).mean(1)
    white, emissive = (direct + light).mean(1), world.scenery.emissive
    # shades of the room's whole colour would be yellower than what they light
    tinted = white**0.8 * (white @ LUMA) ** 0.2
    glow = np.interp(world.scenery.lights.day, (0, 1), GLOWING) * tinted / float((emissive @ LUMA).max(initial=1e-6))
    most = float(SUNNY * white @ LUMA / max(world.sun @ LUMA, 1e-6)) if world.view.inside else 1.0
    sun, glow = world.sun * np.float32(min(most, 1.0)), glow.astype(np.float32)
    return world._replace(thrown=coarse.thrown, glow=glow, white=white, sun=sun)
