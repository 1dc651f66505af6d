"""Rules on semantics labels of what is no object of the graph too: walls, floors, doors, small things."""

from __future__ import annotations

from collections.abc import Iterator

from pxr import Usd

from echomodel.vocabulary import UnknownWord, normalised
from echousd.checks.findings import Finding, rule
from echousd.checks.reading import Reading
from echousd.stage import encoding as usd
from echousd.stage.labels import is_structure, known_category, spaced
from echousd.stage.taxonomy import SHELL, ade20k
from echousd.stage.values import texts

CLASSES = "semantics:labels:ade20k"


@rule("echo:LabelsAgree", "prims")
def agreeing_labels(reading: Reading, prim: Usd.Prim) -> Iterator[Finding | str]:
    """Labels of walls, floors, ceilings, doors and windows are what their names say; two taxonomies say the same."""
    words, classes = texts(prim.GetAttribute(usd.LABELS)), texts(prim.GetAttribute(CLASSES))
    if len(words) != 1:
        return
    word = normalised(words[0])
    named = spaced(prim.GetName()).split("_")
    meant = named[-1]  # a wall clock is none, and a ceiling lamp neither, whichever word comes last
    shared = not {each.removesuffix("s") for each in word.split("_")}.isdisjoint({*named, SHELL.get(meant, meant)})
    other = meant in SHELL and not shared
    if other and not any(prim.GetPath().HasPrefix(node.GetPath()) for node in reading.nodes):
        known = is_structure(word) or known_category(word) is not None
        told = f"{usd.LABELS} is {words[0]!r}, its name says {meant!r}"
        yield Finding(prim.GetPath(), told, warning=not known)
    if len(classes) == 1:
        try:
            same = ade20k(word)
        except UnknownWord:
            return
        if normalised(classes[0]) != normalised(same):
            yield f"{CLASSES} is {classes[0]!r}, allowed with {words[0]!r}: {same!r}"
