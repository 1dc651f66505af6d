"""What a person would point at in a room: the terms that it misses, in words, and what cannot be walked to.

From the door a robot of 0.2 m radius finds its way to every piece (as SceneEval and PhyScene ask of rooms).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from echomodel.arrays import held, rows
from echomodel.boxes2d import footprints
from echomodel.objective.plan import CLEAR_HEIGHT, Plan
from echomodel.objective.table import TERMS
from echomodel.openings import inward_normal, segment

ROBOT, SLACK = 0.2, 0.025  # metres, its radius, and how much narrower a way it squeezes through
STEP = 0.1  # metres beyond that between a door and where it enters
LEAST = 1e-4  # square metres: no smaller place to be
BEFORE = 0.35  # metres around the place before a door from which one walks
ARM = 0.4  # metres between the robot and what it can take hold of
OPEN = 0.75  # share of the free floor that it gets to: in 94 % of 300 real rooms


@dataclass(frozen=True, eq=False)
class Ways:
    """What can be walked to.

    Arguments:
        reached: (n,) bool, boxes that the robot can touch.
        share: of the floor that is free for its middle, the share that it can get to; 1 where nothing is free.
        closing: (n,) bool, boxes between that and a part that another door leads to, or the largest of the rest.
        parted: whether it gets to no other door from there.
    """

    reached: np.ndarray
    share: float
    closing: np.ndarray
    parted: bool = False


REACHED = "reached"
MOST = 2.0  # of a missed unit counts
ROUNDING = 1e-4  # metres: boxes are written to a tenth of a millimetre, meshes in single precision
BY_EYE = ("living", "composition")  # kinds of terms; relations and collisions have verdicts of their own


@dataclass(frozen=True)
class Fault:
    """Something that a person would point at.

    Arguments:
        object: number of the box; other: number of the box that it is about, -1 = none.
        rule: name of the term that is broken. margin: by how much, negative, metres, radians or a share.
        says: the sentence, with {a} and {b} for the two.
    """

    object: int
    other: int
    rule: str
    margin: float
    says: str = field(compare=False)

    def sentence(self, names: Sequence[str]) -> str:
        """The fault in words, with the names of the boxes."""
        other = names[self.other] if self.other >= 0 else "a wall"
        return self.says.replace("{a}", names[self.object]).replace("{b}", other)


def faults(plan: Plan) -> list[Fault]:
    """What a person would point at in one room, in the order of the terms, each box at most once by each."""
    return faults_of(plan) + unreached(plan)


def faults_of(plan: Plan, kinds: Collection[str] = BY_EYE) -> list[Fault]:
    """The faults of all terms of some kinds, for any number of rooms; numbers count through them."""
    out = []
    for term in TERMS:
        if term.kind not in kinds:
            continue
        seen = term.find(plan)
        for row in rows(seen.margin < -ROUNDING).tolist():
            who, other = int(seen.who[row]), int(seen.other[row])
            if bool(plan.fixed[who]):
                continue
            text = term.says[int(seen.words[row]) % len(term.says)]
            sentence = text.replace("{a}", "\0").replace("{b}", "\1").format(x=max(float(seen.measure[row]), 0.0))
            sentence = sentence.replace("\0", "{a}").replace("\1", "{b}")
            out.append(Fault(who, other, term.name, float(seen.margin[row]), sentence))
    return out


def unreached(plan: Plan) -> list[Fault]:
    """Pieces of one room that cannot be walked to, or close the way to much of it; none where the floor is unknown."""
    walked = walk(plan)
    if walked is None:
        return []
    furniture = plan.standing & plan.of("seat", "sofa", "board", "bed", "storage")
    attends = np.asarray(plan.anchor)  # a nightstand is reached from its bed, a chair with its table
    reached = walked.reached | ((attends >= 0) & walked.reached[attends])
    free = ~np.asarray(plan.fixed)
    lost = np.flatnonzero(np.asarray(furniture) & free & ~reached)
    out = [Fault(int(i), -1, REACHED, -1.0, "{a} cannot be walked to from the door") for i in lost]
    closing = np.flatnonzero(walked.closing & free)
    if (walked.share < OPEN or walked.parted) and len(closing):
        smallest = int(closing[np.asarray(held(plan.size))[closing].prod(1).argmin()])
        what = "another door" if walked.parted else f"{100 * (1 - walked.share):.0f} % of the free floor"
        least = 1.0 if walked.parted else OPEN
        out.append(Fault(smallest, -1, REACHED, walked.share - least, f"{{a}} closes the way to {what}"))
    return out


def walk(plan: Plan) -> Ways | None:
    """Where a robot gets to in a plan of one room from the door or passage that leads to most of it, or in its largest
    free part where there are none; chairs are pulled aside. None where its floor is unknown."""
    import shapely

    if not plan.rooms:
        return None
    _, polygon, openings = plan.rooms[0]
    size, position, yaw = (np.asarray(held(of)) for of in (plan.size, plan.position, plan.yaw))
    obstacle = np.asarray(plan.standing & ~(plan.movable & plan.stands("at"))) & (size[:, 1] > CLEAR_HEIGHT)
    boxes = shapely.polygons(footprints(size, position, yaw))
    taken = shapely.union_all(shapely.buffer(boxes[obstacle], ROBOT - SLACK, quad_segs=4))
    free = shapely.difference(shapely.buffer(shapely.Polygon(polygon), SLACK - ROBOT, join_style="mitre"), taken)
    parts = shapely.get_parts(free)
    parts = parts[shapely.area(parts) > LEAST]
    if not len(parts):
        return Ways(np.zeros(len(size), bool), 1.0, np.zeros(len(size), bool))
    area, led = shapely.area(parts), np.zeros(len(parts), bool)
    for opening in openings:
        if opening.kind != "window" and opening.edge < len(polygon):
            inside = segment(polygon, opening).mean(0) + inward_normal(polygon, opening.edge) * (ROBOT + STEP)
            met = shapely.area(shapely.intersection(parts, shapely.Point(inside).buffer(BEFORE)))
            led[met.argmax()] |= met.max() > 0
    order = np.argsort(-area - area.sum() * led)  # those at doors first, the larger before the others
    walked, rest = parts[order[0]], parts[order[:2][-1]]
    closing = obstacle & shapely.dwithin(walked, boxes, ROBOT) & shapely.dwithin(rest, boxes, ROBOT)
    share, parted = float(area[order[0]] / area.sum()), bool(led[order[1:]].any())
    return Ways(shapely.dwithin(walked, boxes, ROBOT + ARM), share, closing, parted)
