"""Small distances: as they were drawn where a person leaves them so, else spread as in real rooms, not all alike."""

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from echomodel.boxes2d import hull, seen
from echomodel.sizes import USUAL_GAPS, back_gaps, quantile
from echomodel.vocabulary import vocabulary

BEHIND = (0.0, 0.08)  # metres between a back and its wall: more is seen as away from it, none runs into it
GRAZE = 0.005  # metres
HUNG = 0.01  # the same of what hangs on a wall
# Least, middle, deviation and most of what belongs at no wall but stands there: 3 of 4 real plants keep less than 0.09
# metres, lamps less than 0.15.
IN_THE_ROOM = (0.02, 0.06, 0.06, 0.18)


@dataclass(frozen=True)
class Usual:
    """What of a distance, in metres, is kept as it was drawn, and how the others are spread.

    Arguments:
        least, most: what is kept lies between; middle, deviation: of the others; floor: none comes nearer than that.
    """

    least: float
    most: float
    middle: float
    deviation: float
    floor: float = -math.inf

    def of(self, drawn: np.ndarray, luck: float) -> float:
        """The median of what is kept of drawn metres (k,), or what the standard score `luck` stands for."""
        within = drawn[(drawn >= self.least) & (drawn <= self.most)]
        found = float(np.median(within)) if len(within) else self.middle + self.deviation * luck
        return max(min(max(found, self.least), self.most), self.floor)


# By how a piece stands to what it attends: metres between the two, negative under it.
APART = {
    "around": Usual(-0.24, 0.05, -0.085, 0.08),
    "at_front": Usual(-0.24, 0.05, -0.08, 0.08),
    "head": Usual(-0.15, 0.12, 0.0, 0.05, floor=0.0),
    "before": Usual(0.3, 0.5, 0.38, 0.06),
    "beside": Usual(0.02, 0.3, 0.1, 0.08),
}
BESIDE = Usual(-0.3, 0.15, -0.05, 0.12)  # metres that side tables stand before the middle of their sofa's ends
BED_LIT = Usual(-0.1, 0.25, 0.05, 0.08)  # metres from the middle of a bed to its lamp, towards the foot
MOST_UNDER = 0.45  # of its depth that a chair is pushed under its table


def score(category: str, size: np.ndarray) -> float:
    """A standard score drawn for pieces of a category and size (3,), the same for equal ones, in any room."""
    piece = f"{category} {' '.join(str(round(side * 100)) for side in size.tolist())}"
    return NormalDist().inv_cdf((zlib.crc32(piece.encode()) + 0.5) / 2**32)


def kept_behind(categories: Sequence[str], size: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """(n,) float: metres that pieces keep between their backs and a wall: as drawn within what is usual, or spread.

    Arguments:
        size: (n, 3) float, metres. drawn: (n,) float, metres between each and the wall that it leans on; NaN = on none.
    """
    out = np.full(len(categories), HUNG)
    for i, word in enumerate(categories):
        kind, luck = vocabulary().category(word), score(word, size[i])
        if kind.support == "wall":
            continue
        if BEHIND[0] - GRAZE <= drawn[i] <= BEHIND[1]:
            out[i] = max(drawn[i], BEHIND[0])
        elif kind.wall or kind.access:
            found = back_gaps(word)
            low, middle, high = found if found[1] < BEHIND[1] else USUAL_GAPS  # desks, half of them further off
            spread = quantile((2 * low - middle, low, middle, high, 2 * high - middle), luck)
            out[i] = min(max(spread, BEHIND[0]), BEHIND[1])
        else:
            out[i] = spread_at_walls(word, size[i])
    return out


def spread_at_walls(category: str, size: np.ndarray) -> float:
    """Metres to the wall of a piece of size (3,) that belongs at none but stands there: a plant, a lamp."""
    least, middle, deviation, most = IN_THE_ROOM
    return min(max(middle + deviation * score(category, size), least), most)


def kept_apart(stands: str, drawn: np.ndarray, anchor: str, whole: np.ndarray) -> tuple[float, float]:
    """Metres that all who stand so keep from what they attend, and those by which they stand before its middle.

    Arguments:
        stands: how they stand, a key of `APART`. drawn: (k, 4) float, `seen_from` of them as drawn.
        anchor, whole: category of what they attend, and its size (3,).
    """
    beside = stands in ("head", "beside")
    gaps = drawn[:, 2:].max(1) if stands == "around" else drawn[:, 2 if beside else 3]
    ahead = BESIDE.of(drawn[:, 1], score(anchor, whole[::-1])) if stands == "beside" else 0.0
    return APART[stands].of(gaps, score(anchor, whole)), ahead


def seen_from(size: np.ndarray, position: np.ndarray, yaw: np.ndarray, of: int) -> np.ndarray:
    """(n, 4) float, metres: where boxes stand in the frame of box `of`, sideways and ahead, and the gaps between both.

    Arguments:
        size, position: (n, 3) float, metres; yaw: (n,) float, radians.
    """
    away = seen((position - position[of])[:, [0, 2]], yaw[of])
    gaps = np.abs(away) - hull(size[:, [0, 2]] / 2, yaw - yaw[of]) - size[of, [0, 2]] / 2
    return np.concatenate([away, gaps], 1)


def over_bed(size: np.ndarray, position: np.ndarray, yaw: np.ndarray, lamp: int, bed: int) -> float:
    """Metres along the longer sides of a bed from its middle to the lamp over it; boxes as `seen_from`."""
    if size[bed, 0] >= size[bed, 2]:
        return 0.0
    aside, ahead, _, _ = seen_from(size, position, yaw, bed)[lamp]
    drawn = np.array([ahead] if abs(aside) < size[bed, 0] / 4 else [])
    return BED_LIT.of(drawn, score("pendant_lamp", size[lamp]))
