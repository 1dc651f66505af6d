"""Where boxes may stand at what they attend: slots in a setting, and the distances that are kept there."""

from __future__ import annotations

import math

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.repair.arrange.setting import Setting, State
from echousd.repair.arrange.slots import INNER, STANDS, Slot
from echousd.repair.distances import APART, MOST_UNDER, kept_apart, seen_from

Row = tuple[float, float, float, float]  # x, z, yaw, price


def slots_at(setting: Setting, i: int, anchor: int) -> list[Slot]:
    """Where box i may stand in the frame of its anchor; empty where its row does not say."""
    if (i, anchor) in setting.slots:
        return setting.slots[i, anchor]
    stands = stance(setting, i, anchor)
    if stands not in STANDS:
        return []
    count = int(setting.sitting[(setting.anchor == anchor) & setting.seats].sum())
    near = apart(setting, i, anchor)
    found = STANDS[stands](setting.size[i], setting.size[anchor], setting.kinds[anchor], count, *near)
    if stands == "head":  # all with the same gap to the wall
        level = float(setting.behind[_mates(setting, stands, anchor)[0]] - setting.behind[anchor])
        found = [(lateral, forward + level, turn, price) for lateral, forward, turn, price in found]
    setting.slots[i, anchor] = found
    return found


def apart(setting: Setting, i: int, anchor: int) -> tuple[float, float]:
    """Metres between box i and its anchor and those it stands before its middle, as `distances.kept_apart`."""
    stands = stance(setting, i, anchor)
    if stands not in APART:
        return 0.0, 0.0
    drawn = seen_from(setting.size, setting.draft, setting.heading, anchor)[_mates(setting, stands, anchor)]
    if stands == "before" and setting.kinds[anchor].name in vocabulary().cornered:
        drawn = drawn + np.array([0.0, 0.0, 0.0, INNER])
    kept, ahead = kept_apart(stands, drawn, setting.categories[anchor], setting.size[anchor])
    return max(kept, -MOST_UNDER * float(setting.size[i, 2])), ahead


def _mates(setting: Setting, stands: str, anchor: int) -> list[int]:
    """All who stand so to a box."""
    return [j for j in np.flatnonzero(setting.anchor == anchor).tolist() if stance(setting, j, anchor) == stands]


def stance(setting: Setting, i: int, anchor: int) -> str:
    """How box i stands to what it attends: the name of its slots, or of the row's own word where it has none."""
    kind, to = setting.kinds[i], setting.kinds[anchor]
    if setting.carrier[i] == anchor:
        return "on_top"
    if kind.support != "floor":
        return ""
    if kind.stands in ("at", "foot") and to.role == "board":
        return "at_front" if to.access else "around"
    return setting.stances[i]


def at_anchor(setting: Setting, state: State, i: int, anchor: int) -> list[Row]:
    """The slots of box i at its anchor as it stands now."""
    return [out_of(state.position[anchor], float(state.yaw[anchor]), slot) for slot in slots_at(setting, i, anchor)]


def expect_followers(setting: Setting, state: State, i: int) -> None:
    """Move what attends box i and is not placed yet to its best slot there, for others to reckon with (in `state`)."""
    for j in np.flatnonzero((setting.anchor == i) & ~state.placed).tolist():
        slots = slots_at(setting, j, i) if j != i else []
        if slots and setting.standing(j):
            best = min(slots, key=lambda slot: slot[3])
            state.position[j, 0], state.position[j, 2], state.yaw[j], _ = out_of(
                state.position[i], float(state.yaw[i]), best
            )
            expect_followers(setting, state, j)


def out_of(position: np.ndarray, yaw: float, slot: Slot) -> Row:
    """Where a slot of something at a position (3,) lies in the room."""
    lateral, forward, turn, price = slot
    c, s = math.cos(yaw), math.sin(yaw)
    x, z = position[0] + c * lateral + s * forward, position[2] - s * lateral + c * forward
    return float(x), float(z), yaw + turn, price
