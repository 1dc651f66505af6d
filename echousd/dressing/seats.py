"""Cushions and throws on sofas and armchairs, which have arms and a back."""

import numpy as np

from echomodel.boxes2d import upright
from echousd.dressing import soft_tops as tops
from echousd.dressing.setting import Setting, Standing, Thing

MORE = (1.9, 2.4)  # metres of a sofa with a third cushion in its middle, and with two
OVER, SHORT, LONG = 0.019, (0.2, 0.3), (0.32, 0.45)  # metres of a throw's top over an arm, and that it hangs down
RISE = 0.06  # metres that an arm rises along a throw at most: off a steeper one it slides, and a tub's walls are round
# Shares of a cushion's width and height at which is looked for what is behind it, metres within which that is; from
# where on a back is round; by which forms of cushions differ.
ACROSS, UPWARDS, REACH, BENT, BY = np.linspace(-0.4, 0.4, 5), np.linspace(0.2, 0.9, 4), 0.4, 0.02, 0.02
RIDGE = 0.1  # metres that an arm is higher than the seat at least so that a throw hangs over it


def cushions_on(
    setting: Setting, host: Standing, seat: tops.Seat, pair: tops.Design, odd: tops.Design, rng: np.random.Generator
) -> None:
    """Cushions in the corners of a sofa, a pair or two that differ, on a wide one others between; one on an armchair.

    `seat`: of the host. `pair`, `odd`: designs that go together.
    """
    wide = float(host.size[0])
    narrow = min(pair, odd, key=lambda design: float(design[1][0]))
    ends = [(-1.0, pair), (1.0, pair if rng.random() < 0.6 else odd)]
    more = setting.full or rng.random() < 0.75
    apart = 0.28 / (wide / 2 - 0.25) if wide > MORE[1] else 0.0
    ends += [(end, odd) for end in dict.fromkeys((-apart, apart)) if more and wide > MORE[0]]
    for end, (kind, size, variant) in ends if wide > 1.3 else [(float(rng.choice([-0.6, 0.6])), narrow)]:
        turn = -0.28 * end * float(rng.uniform(0.3, 1.6))
        if (spot := at_back(seat, end, size)) is None:
            continue
        aside, lean, bend = behind(host, spot, turn, size)
        turn -= float(np.arctan(aside)) * (bend > BENT)
        leant = np.clip([lean * size[1], bend], (0.1 * size[1], 0.0), (0.4 * size[1], 0.08)) // BY * BY
        for lie in (tuple(leant.round(2).tolist()), (0.0, 0.0)):  # upright on what is too shallow
            deep = size + np.array([0.0, 0.0, sum(lie)])
            spot = standing_on(host, at_back(seat, end, deep), turn, deep, tops.corners_of(kind, deep, variant, lie))
            if tops.put(setting, host, spot, kind, deep, turn, variant, lie):
                break


def standing_on(
    host: Standing, spot: np.ndarray | None, turn: float, size: np.ndarray, body: np.ndarray
) -> np.ndarray | None:
    """The spot (3,) or one near it where a turned cushion stands level and reaches into nothing; None = nowhere."""
    for _ in range(tops.TRIES):
        spot = None if spot is None else tops.clear_of(host, spot, turn, body)
        down = None if spot is None else tops.let_down(host, spot, size)
        if down is None:
            return None
        spot = tops.clear_of(host, down + np.array([0.0, tops.LIFTED, 0.0]), turn, body)
        if spot is not None and np.abs(spot - down).max() < tops.LEVEL:
            return np.array([spot[0], down[1], spot[2]])
    return None


def behind(host: Standing, spot: np.ndarray, turn: float, size: np.ndarray) -> np.ndarray:
    """(3,) float of what is behind a turned cushion at a spot (3,): metres a metre that it is nearer at the right, and
    further away over the seat, and metres that it is nearer at both sides than in the middle."""
    corners = (host.geometry.mesh.triangles - spot) @ upright(turn)
    corners = corners[corners[..., 2].max(1) < size[2]]
    ends = tops.heights_of(corners[..., [0, 2, 1]], ACROSS * size[0], UPWARDS * size[1])
    x, y = (line[ends > -REACH] for line in np.meshgrid(ACROSS * size[0], UPWARDS * size[1], indexing="ij"))
    terms = np.stack([x, -y, (2 * x / size[0]) ** 2, 1 + 0 * x], 1)
    return np.linalg.lstsq(terms, ends[ends > -REACH], rcond=None)[0][:3]


def at_back(seat: tops.Seat, end: float, size: np.ndarray) -> np.ndarray | None:
    """(3,) a place on the seat against the back, towards one end (-1 to 1); None where there is none."""
    free = np.abs(seat.height - seat.level) < 0.07
    wide, deep = (max(1, int(np.ceil(size[k] / tops.STEP))) for k in (0, 2))
    if wide > len(seat.x) or deep > len(seat.z):
        return None
    total = np.cumsum(np.cumsum(np.pad(free.astype(int), ((1, 0), (1, 0))), 0), 1)
    count = total[wide:, deep:] - total[:-wide, deep:] - total[wide:, :-deep] + total[:-wide, :-deep]
    fits = np.argwhere(count >= 0.93 * wide * deep)
    if not len(fits):
        return None
    wish = (1 + end) * (len(seat.x) - wide) / 2
    i, k = fits[int(np.argmin(fits[:, 1] * 1.5 + np.abs(fits[:, 0] - wish)))]
    above = seat.level + tops.RAISED / 4  # it may be fuller in its middle
    return np.array([seat.x[i] + (wide - 1) * tops.STEP / 2, above, seat.z[k] + (deep - 1) * tops.STEP / 2])


def over_arm(host: Standing, seat: tops.Seat, side: float, rng: np.random.Generator) -> Thing | None:
    """A throw over the arm of a sofa at a side, below 0 the left one; None where there is none to hang it over."""
    z, deep = 0.12 * float(host.size[2]), float(rng.uniform(0.42, 0.6))
    under = seat.height[:, np.abs(seat.z - z) < deep / 2]
    level = under.min(1)
    arm = (level > seat.level + RIDGE) & (np.sign(side) * seat.x > 0.3 * host.size[0])
    if not 0.08 < arm.sum() * tops.STEP < 0.34 or np.ptp(under[arm], axis=1).max() > RISE:
        return None
    high = float(np.median(level[arm]))
    falls = np.minimum(rng.uniform(SHORT, LONG), (high - seat.level - 0.03, high - 0.12))  # over the seat, outside
    return tops.across(host, seat, arm, z, deep, falls[:: int(side)], OVER, rng)
