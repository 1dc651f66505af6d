"""Stages that show one layout or variant for a while, without a change to any file."""

from collections.abc import Iterator
from contextlib import contextmanager

from pxr import Sdf, Usd

from echousd.stage.encoding import StageError
from echousd.stage.files import source
from echousd.stage.pen import VARIANTS, layout_names, layout_prims


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
    with _chosen(stage, layout_prims(stage), VARIANTS, name):
        yield name


def each_layout(stage: Usd.Stage, layout: int | None = None) -> Iterator[str]:
    """Names of all layouts of a stage, or of one by its number, each shown while a loop is at it; "" for an only one.

    Raises StageError for a layout that there is not.
    """
    names: tuple[str | int | None, ...] = (layout_names(stage) or (None,)) if layout is None else (layout,)
    for name in names:
        with showing_layout(stage, name) as shown:
            yield shown


@contextmanager
def showing_variant(stage: Usd.Stage, variants: str, name: str) -> Iterator[bool]:
    """Within the block, every prim that has a variant of a set shows it; yields whether some prim showed another."""
    prims = [
        prim for prim in stage.Traverse() if prim.HasVariantSets() and prim.GetVariantSets().HasVariantSet(variants)
    ]
    others = [prim for prim in prims if prim.GetVariantSet(variants).GetVariantSelection() != name]
    if not others:
        yield False
        return
    with _chosen(stage, others, variants, name):
        yield True


@contextmanager
def _chosen(stage: Usd.Stage, prims: list[Usd.Prim], variants: str, name: str) -> Iterator[None]:
    """Within the block, prims show one of their variants, those that have it."""
    sets = [prim.GetVariantSet(variants) for prim in prims]
    sets = [found for found in sets if name in found.GetVariantNames()]
    session = stage.GetSessionLayer()
    before = session.ExportToString()
    with Usd.EditContext(stage, session), Sdf.ChangeBlock():
        for found in sets:
            found.SetVariantSelection(name)
    try:
        yield
    finally:
        session.ImportFromString(before)
