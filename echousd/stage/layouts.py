"""The layouts of a room: variants of the set `layout`, listed and selected without a change to any file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Usd

from echousd.stage.encoding import StageError
from echousd.stage.files import source

VARIANTS = "layout"


def layout_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """The prims with a variant set `layout`; rooms of one layout have none."""
    rooms = stage.GetPseudoRoot().GetChildren()
    prims = [prim for room in rooms for prim in (room, *room.GetChildren())]
    return [prim for prim in prims if VARIANTS in prim.GetVariantSets().GetNames()]


def layout_names(stage: Usd.Stage) -> tuple[str, ...]:
    """All layouts of a stage, `layout_0` first; empty where there is only one."""
    names = {name for prim in layout_prims(stage) for name in prim.GetVariantSet(VARIANTS).GetVariantNames()}
    return tuple(sorted(names, key=lambda name: (len(name), name)))


def selected_layout(stage: Usd.Stage) -> str:
    """Which layout a stage shows, "" where there is only one."""
    return next((prim.GetVariantSet(VARIANTS).GetVariantSelection() for prim in layout_prims(stage)), "")


@contextmanager
def showing_layout(stage: Usd.Stage, layout: int | str | None) -> Iterator[str]:
    """Within the block, a stage shows one of its layouts (None = the one that it shows); yields its name.

    Arguments:
        layout: the number, or the name of the variant.

    Raises StageError for a layout that there is not.
    """
    if layout is None:
        yield selected_layout(stage)
        return
    names = layout_names(stage)
    name = f"layout_{layout}" if isinstance(layout, int) else layout
    if not names and name == "layout_0":  # the only one
        yield ""
        return
    if name not in names:
        there = ", ".join(names) if names else "layout_0 (there is only one)"
        raise StageError(f"{source(stage)}: no layout {layout!r}, allowed: {there}")
    sets = [prim.GetVariantSet(VARIANTS) for prim in layout_prims(stage)]
    sets = [variants for variants in sets if name in variants.GetVariantNames()]
    session = stage.GetSessionLayer()
    before = session.ExportToString()
    with Usd.EditContext(stage, session):
        for variants in sets:
            variants.SetVariantSelection(name)
    try:
        yield name
    finally:
        session.ImportFromString(before)
