"""Patterns of surfaces as tileable arrays: how light or dark, how high and how rough each point is.

Every pattern is the same in every run and on every machine; colour comes later, as one tint for the whole picture.
"""

from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import pairwise

import numpy as np

from echomodel.compiled import Compiled

cKDTree = Compiled("scipy.spatial._ckdtree:cKDTree")
SIZE = 512  # pixels on each side
# Creases of cloth, in shares of the picture: how far they reach from their middles; least and most of their places x
# and y, radians, bend, length, width, height over that, and what says which run across; how many there are.
REACH = 0.336
CREASES = (0, 0, -0.6, -1.3, 0.06, 0.008, 0.1, 0), (1, 1, 0.6, 1.3, 0.17, 0.035, 0.4, 1), (60, 8)


@dataclass(frozen=True, eq=False)
class Relief:
    """One pattern."""

    # (n, n) or (n, n, 3) float, n `SIZE` or twice that, over its mean what the tint is multiplied with
    tone: np.ndarray
    height: np.ndarray | None = None  # (SIZE, SIZE) float, metres above the mean, None for what is flat
    rough: np.ndarray | None = None  # (SIZE, SIZE) float, added to the roughness, None where it is even


@lru_cache(maxsize=12)  # those of wear, paint and piles are asked for by image after image
def noise(seed: int, along: float, across: float, power: float = 2.0) -> np.ndarray:
    """(SIZE, SIZE) periodic noise of deviation 1; features are about `SIZE / along` x `SIZE / across` pixels."""
    rng = np.random.default_rng(seed)
    v, u = np.meshgrid(np.fft.fftfreq(SIZE) * SIZE, np.fft.rfftfreq(SIZE) * SIZE, indexing="ij")
    radius = np.sqrt((u / along) ** 2 + (v / across) ** 2)
    weight = 1 / (1 + radius**power)
    weight[0, 0] = 0
    out = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(SIZE, SIZE))) * weight, s=(SIZE, SIZE))
    return np.asarray(out / out.std())


def _grid() -> tuple[np.ndarray, np.ndarray]:
    """Columns u and rows v as shares of the picture."""
    axis = np.arange(SIZE) / SIZE
    return axis[None, :], axis[:, None]


def aged(tone: np.ndarray, share: float) -> np.ndarray:
    """A tone as years of use leave it: rubbed paler and darker in patches, by a share of it, its contrasts stronger."""
    patch = np.tile(0.5 * noise(201, 4.0, 4.0, 2.5) + 0.4 * noise(202, 24.0, 24.0), (len(tone) // SIZE,) * 2)
    worn = (1 + 8 * share) * (tone - 1) + 1
    worn *= 1 + share * (patch if tone.ndim == 2 else patch[..., None])
    return worn


def wood(seed: int = 1, rings: int = 9, contrast: float = 0.75) -> Relief:
    """Sawn wood, its fibres along u: bands of early and late wood, streaks, pores."""
    _, v = _grid()
    bands = np.sin(2 * np.pi * (rings * v + 0.55 * noise(seed, 1.2, 3.0, 3.0)))
    streaks, pores = noise(seed + 1, 2.0, 60.0), noise(seed + 2, 12.0, 160.0)
    tone = 1 + contrast * (0.05 * bands + 0.045 * streaks - 0.10 * np.clip(pores - 1.1, 0, 1))
    return Relief(tone, None, 0.05 * streaks)


veneer = partial(wood, 11, 24, 0.25)  # fine and even


def planks(rows: int = 18) -> Relief:
    """Boards along u in a picture twice as wide as others, none like its neighbours: each of a tone, a hue, a length
    and a piece of the trunk of its own."""
    rng, wide = np.random.default_rng(5), 2 * SIZE
    base = np.tile(wood(21, 6, 0.55).tone, (2, 3))
    tone, gap = np.ones((wide, wide, 3)), np.zeros((wide, wide))
    edges = np.arange(rows + 1) * wide // rows
    start = rng.integers(wide)
    for top, bottom in pairwise(edges):
        start += wide // 5 + int(rng.integers(wide // 8))  # no joint beside another
        ends = [start, start + int(rng.integers(wide // 3, 2 * wide // 3)), start + wide]
        for first, last in pairwise(ends):
            x, y = rng.integers(SIZE, size=2)
            piece = base[y : y + bottom - top, x : x + last - first, None] * rng.normal(1.0, 0.075)
            tone[top:bottom, np.arange(first, last) % wide] = piece * (1 + rng.normal(0, 0.03) * np.array([-0.4, 0, 1]))
            gap[top:bottom, first % wide] = 1
        gap[top] = 1
    rough = 0.04 * np.tile(noise(23, 3.0, 40.0), (2, 2)) + 0.2 * gap
    tone *= 1 - 0.5 * gap[..., None]
    return Relief(tone, -0.0006 * gap, rough)


def herringbone(length: int = 4) -> Relief:
    """Blocks of `length` times their width, at right angles to one another."""
    cell = SIZE // (2 * length)
    rng, base = np.random.default_rng(6), wood(21, 6, 0.55).tone
    rows, columns = np.indices((SIZE, SIZE))
    i, j = columns // cell, rows // cell
    step = (i - j) % (2 * length)
    lies = step < length
    first = np.where(
        lies, (i - step) % (2 * length) + 2 * length * j, i + 2 * length * ((j + step - length) % (2 * length))
    )
    own = rng.normal(1.0, 0.06, (2, first.max() + 1))[lies.astype(int), first]
    shift = rng.integers(SIZE, size=first.max() + 1)[first]
    along, across = np.where(lies, columns, rows), np.where(lies, rows, columns)
    tone = base[(across + shift) % SIZE, (along + 2 * shift) % SIZE] * own
    ends = np.where(lies, step == 0, step == 2 * length - 1) & (along % cell == 0)
    gap = ((across % cell == 0) | ends).astype(float)
    return Relief(tone * (1 - 0.35 * gap), -0.0006 * gap, 0.2 * gap)


def terrazzo(chips: int = 900) -> Relief:
    """Chips of stone in cement, ground flat."""
    rng = np.random.default_rng(7)
    places, radius = rng.uniform(0, SIZE, (chips, 2)), rng.uniform(1.5, 8.0, chips)
    pixels = np.indices((SIZE, SIZE)).reshape(2, -1).T
    warped = (pixels + 2.5 * np.stack([noise(seed, 24.0, 24.0, 4.0).ravel() for seed in (8, 9)], 1)) % SIZE
    away, nearest = cKDTree(places, boxsize=SIZE).query(warped, distance_upper_bound=12.0)
    chip = away < np.append(radius, 0.0)[nearest]
    hues = np.array([(0.72, 0.70, 0.68), (1.12, 1.10, 1.06), (0.98, 0.80, 0.66), (0.86, 0.90, 0.86)])
    tone = np.where(chip[:, None], hues[rng.integers(len(hues), size=chips + 1)[nearest]], 1.0).reshape(SIZE, SIZE, 3)
    return Relief(tone)


def boarded(boards: int = 8) -> Relief:
    """Painted boards side by side, upright, with a groove between them, each of a tone of its own."""
    u, v = _grid()
    own = np.random.default_rng(73).normal(1.0, 0.012, boards)[np.floor(boards * u).astype(int)]
    apart = np.abs((boards * u + 0.5) % 1.0 - 0.5) + 0 * v
    groove = np.clip(1 - apart / 0.035, 0, 1)
    return Relief(own * (1 - 0.28 * groove), -0.004 * groove)


def brick(rows: int = 32, across: int = 8) -> Relief:
    """Stretchers in running bond, no edge straight, each of a tone and a hue of its own, with pale joints."""
    u, v = (line + 0.0009 * noise(seed, 40.0, 40.0, 3.0) for line, seed in zip(_grid(), (12, 13), strict=True))
    row = np.floor(rows * v).astype(int) % rows
    place = across * u + 0.5 * (row % 2)
    edge = np.minimum(np.abs((place + 0.5) % 1.0 - 0.5) / across, np.abs((rows * v + 0.5) % 1.0 - 0.5) / rows)
    joint, rng = np.clip(1.6 - edge / 0.0028, 0, 1), np.random.default_rng(10)
    number = row, np.floor(place).astype(int) % across
    own, hue = (rng.normal(mean, spread, (rows, across))[number] for mean, spread in ((1.0, 0.14), (0.0, 0.06)))
    grain = noise(11, 60.0, 60.0)
    fired = own + 0.07 * grain + 0.05 * noise(14, 12.0, 12.0)
    mortar = (1.35 + 0.05 * grain)[..., None] * (1.0, 1.25, 1.4)  # is no red
    joint = joint[..., None]
    tone = fired[..., None] * (1 + hue[..., None] * (0.2, 1.0, 0.7)) * (1 - joint) + mortar * joint
    return Relief(tone, 0.0006 * grain * (1 - joint[..., 0]) - 0.004 * joint[..., 0], 0.1 * joint[..., 0])


def woven(threads: int = 64) -> Relief:
    """Plain weave of nearly one tone from afar, in hardly any folds: what is firm would look like stone in more."""
    u, v = _grid()
    over = np.sin(np.pi * threads * u) * np.sin(np.pi * threads * v) > 0
    height = np.where(over, np.abs(np.sin(2 * np.pi * threads * u)), np.abs(np.sin(2 * np.pi * threads * v)))
    yarn = 0.6 * noise(31, 24.0, 200.0) + 0.6 * noise(32, 200.0, 24.0)
    return Relief(1 + 0.1 * height + 0.04 * yarn + 0.006 * noise(33, 4.0, 4.0, 3.0), 0.0001 * height + 0.2 * creased())


@cache  # four cloths lie in the same
def creased() -> np.ndarray:
    """(SIZE, SIZE) how high cloth of a metre lies that was used, metres: in folds that end, most about along u."""
    rng, height = np.random.default_rng(53), 0.001 * noise(53, 4.0, 6.0, 4.0)
    v, u = np.indices((SIZE, SIZE)) / SIZE + 0.012 * np.stack([noise(seed, 3.0, 3.0, 3.0) for seed in (56, 57)])
    for x, y, turn, bend, long, wide, high, crosses in rng.uniform(*CREASES):
        near = np.ix_(*(np.arange(SIZE * (at - REACH), SIZE * (at + REACH)).astype(int) % SIZE for at in (y, x)))
        across, down = ((line[near] - middle + 0.5) % 1 - 0.5 for line, middle in ((u, x), (v, y)))
        turn += np.pi / 2 * (crosses < 0.25)
        s, t = across * np.cos(turn) + down * np.sin(turn), down * np.cos(turn) - across * np.sin(turn)
        t = np.abs(t - bend * s * s) / wide
        height[near] += high * wide * np.exp(-((s / long) ** 2) - t * np.sqrt(t))
    return height - height.mean()


def knitted(stitches: int = 96) -> Relief:
    """Rows of stitches, V beside V, in the folds of a thing that is soft."""
    u, v = _grid()
    slant = np.abs((u * stitches) % 1.0 - 0.5)
    height = np.abs(np.sin(np.pi * (v * stitches + slant))) * (1 - (2 * slant - 0.5) ** 2)
    return Relief(1 + 0.16 * (height - height.mean()) + 0.015 * noise(41, 90.0, 90.0), 0.0004 * height + creased())


def linen() -> Relief:
    """Fine cloth with thick threads here and there."""
    slubs = 0.6 * noise(51, 6.0, 170.0) + 0.6 * noise(52, 170.0, 6.0)
    return Relief(1 + 0.028 * slubs, 0.0002 * slubs)


def rumpled() -> Relief:
    """Linen in the creases and soft folds that sleep leaves in it."""
    slubs = 0.6 * noise(51, 12.0, 220.0) + 0.6 * noise(52, 220.0, 12.0)
    return Relief(1 + 0.024 * slubs + 8 * creased(), 0.0001 * slubs + creased())


def striped(pairs: int = 4) -> Relief:
    """Linen with broad stripes along u, a narrow one beside each."""
    cloth, place = rumpled(), (pairs * _grid()[1]) % 1.0
    broad, narrow = np.abs(place - 0.3) < 0.2, np.abs(place - 0.62) < 0.04
    return Relief(cloth.tone * (1 + 0.55 * broad + 0.4 * narrow), cloth.height)


def checked(pairs: int = 6) -> Relief:
    """Linen woven in squares, darkest where its stripes cross."""
    cloth, band = rumpled(), np.where((pairs * np.arange(SIZE) / SIZE) % 1.0 < 0.5, 0.3, 0.0)
    return Relief(cloth.tone * (1 + band + band[:, None]), cloth.height)


def leather() -> Relief:
    """Grain of small cells."""
    rng = np.random.default_rng(61)
    cells = cKDTree(rng.random((1400, 2)) * SIZE, boxsize=SIZE)
    near = cells.query(np.indices((SIZE, SIZE)).reshape(2, -1).T, k=2)[0]
    height = np.clip((near[:, 1] - near[:, 0]) / 6, 0, 1).reshape(SIZE, SIZE)
    return Relief(1 + 0.14 * (height - height.mean()) + 0.05 * noise(62, 5.0, 5.0), 0.0006 * height)


def plaster() -> Relief:
    """Plaster under matt paint: nearly even, hardly flat, the grain of the roller when one stands before it."""
    fine, soft = noise(71, 110.0, 110.0, 4.0), noise(72, 4.0, 3.0, 3.0)
    return Relief(1 + 0.004 * fine + 0.003 * soft, 0.0001 * fine + 0.0004 * soft)


def papered() -> Relief:
    """Wallpaper: broad soft stripes with a fine line at their edges and sprigs between them."""
    u, v = _grid()
    place = (8 * u) % 1.0
    stripe = 1 / (1 + np.exp(-24 * (np.abs(place - 0.5) - 0.25)))
    line = np.exp(-(((np.abs(place - 0.5) - 0.25) / 0.018) ** 2))
    x, y = (8 * u) % 1.0 - 0.5, (8 * v + 0.5 * np.floor(8 * u)) % 1.0 - 0.5
    sprig = sum(
        np.exp(-(((x - a) / 0.035) ** 2 + ((y - b) / 0.075) ** 2)) for a, b in ((0, 0.1), (-0.07, 0), (0.07, 0))
    )
    return Relief(1 + 0.035 * stripe - 0.06 * line - 0.07 * sprig)


def carpet() -> Relief:
    """Wall-to-wall carpet, loops in rows."""
    fine, soft = noise(83, 200.0, 200.0, 4.0), noise(84, 10.0, 10.0)
    return Relief(1 + 0.06 * fine + 0.012 * soft, 0.0003 * fine)


def carpet_tiles(across: int = 4) -> Relief:
    """Squares of carpet, their rows of loops one way and the other in turns, each of a tone of its own."""
    own, cell = np.random.default_rng(89).normal(1.0, 0.06, (across, across)), np.ones((SIZE // across,) * 2)
    rows, odd = noise(83, 40.0, 240.0, 4.0), np.kron(np.indices(own.shape).sum(0) % 2, cell)
    loops = np.where(odd > 0, rows, rows.T)
    return Relief(np.kron(own, cell) + 0.05 * loops, 0.0003 * loops)


def tiles(across: int = 4) -> Relief:
    """Square floor tiles with joints, each of a tone of its own."""
    u, v = _grid()
    edge = np.minimum(*(np.minimum(w * across % 1.0, 1 - w * across % 1.0) + 0 * u * v for w in (u, v)))
    joint = np.clip(1 - edge / 0.012, 0, 1)
    own = np.kron(np.random.default_rng(85).normal(1.0, 0.02, (across, across)), np.ones((SIZE // across,) * 2))
    return Relief((own + 0.015 * noise(86, 10.0, 10.0)) * (1 - 0.32 * joint), -0.001 * joint, 0.35 * joint)


def brushed() -> Relief:
    """Metal brushed along u."""
    streaks = noise(87, 1.5, 220.0, 1.6)
    return Relief(1 + 0.035 * streaks, None, 0.07 * streaks)


def bound() -> Relief:
    """Book cloth: a fine weave, rubbed at the bands of the spine."""
    _, v = _grid()
    weave = noise(88, 150.0, 150.0, 4.0)
    bands = np.exp(-((((3 * v) % 1.0 - 0.5) / 0.04) ** 2))
    return Relief(1 + 0.035 * weave + 0.10 * bands, 0.0001 * weave)


def wicker(strands: int = 24) -> Relief:
    """Basketwork."""
    u, v = _grid()
    over = np.sign(np.sin(np.pi * strands * u)) * np.sign(np.sin(np.pi * strands * v))
    height = np.where(over > 0, np.abs(np.sin(np.pi * strands * v)), 0.7 * np.abs(np.sin(np.pi * strands * u)))
    return Relief(0.6 + 0.55 * height + 0.05 * noise(91, 20.0, 20.0), 0.0045 * height)


def leaf() -> Relief:
    """Green of two depths."""
    return Relief(np.clip(1 + 0.14 * noise(95, 6.0, 6.0) + 0.05 * noise(96, 60.0, 60.0), 0.5, 1.6))


def stone() -> Relief:
    """Glazed clay with specks."""
    return Relief(1 + 0.02 * noise(98, 6.0, 6.0) - 0.5 * np.clip(noise(97, 90.0, 90.0, 4.0) - 1.9, 0, 1))


@lru_cache(maxsize=4)  # colour, slope and gloss of one are asked for in turn
def relief(name: str) -> Relief:
    """The pattern that the function of that name there draws, its tone 1 in the mean."""
    drawn: Relief = globals()[name]()
    np.divide(drawn.tone, drawn.tone.mean((0, 1)), out=drawn.tone)  # nobody else's, up to 25 MB
    return drawn
