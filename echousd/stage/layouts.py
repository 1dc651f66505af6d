"""The layouts of a room: variants of the set `layout`, listed and written."""

from __future__ import annotations

from pxr import Usd

from echousd.stage.paths import ROOM
from echousd.stage.pen import Pen

VARIANTS = "layout"
ARTICULATION, ARTICULATED = "articulation", "articulated"  # variant set of what opens, and the variant with joints


def layout_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """The prims with a variant set `layout`, at whatever path; rooms of one layout have none."""
    found, prims = [], iter(Usd.PrimRange.Stage(stage))
    for prim in prims:
        if VARIANTS in prim.GetVariantSets().GetNames():
            found.append(prim)
        if prim.IsComponent():  # no room
            prims.PruneChildren()
    return found


def layout_names(stage: Usd.Stage) -> tuple[str, ...]:
    """All layouts of a stage, `layout_0` first; empty where there is only one."""
    names = {name for prim in layout_prims(stage) for name in prim.GetVariantSet(VARIANTS).GetVariantNames()}
    return tuple(sorted(names, key=lambda name: (len(name), name)))


def layout_pens(pen: Pen, count: int, chosen: str | None = None) -> list[Pen]:
    """A pen for each layout of a room, in the variant of its number; one alone is no variant.

    Arguments:
        chosen: the variant that is seen, None = another layer says which.
    """
    names = [f"{VARIANTS}_{number}" for number in range(count)]
    return [pen] if count == 1 else list(pen.variants(ROOM, VARIANTS, names, chosen).values())
