"""Rules on values, whatever they describe: of their type, finite, at rest, of variants and payloads that are there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom

from echomodel.vocabulary import vocabulary
from echousd.checks.findings import Finding, rule
from echousd.checks.reading import Reading
from echousd.stage.files import said
from echousd.stage.values import LARGEST, misfit, shown

WRAPS = ("black", "clamp", "repeat", "mirror", "useMetadata")
WORDS = {"inputs:sourceColorSpace": ("raw", "sRGB", "auto"), "inputs:wrapS": WRAPS, "inputs:wrapT": WRAPS}
ENGINES = {"physics:approximation": ("sdf", "sphereFill", "convexMeshSimplification")}  # words that only some know
SPOKEN = {"echo:predicate": "predicates", "echo:roomType": "room_types"}
INVERTED = "!invert!"
RESET = "!resetXformStack!"


@rule("echo:ValueTypes", "authored")
def value_types(_reading: Reading, attribute: Usd.Attribute) -> Iterator[str]:
    """Every value can be read is of the type of its attribute and one of its words: clients read nothing, or crash."""
    try:
        found = attribute.Get()
    except Tf.ErrorException as error:
        yield f"a value that cannot be read: {said(error)}"
        return
    if misfit(attribute.GetTypeName(), found):
        yield f"holds {shown(found)}, allowed: {attribute.GetTypeName()}"
    elif isinstance(found, str) and attribute.GetTypeName() == Sdf.ValueTypeNames.Token:
        words = attribute.GetMetadata("allowedTokens") or WORDS.get(attribute.GetName())
        if words and attribute.GetName() in SPOKEN:  # the schema may be older than the words
            words = (*words, *(row.name for row in getattr(vocabulary(), SPOKEN[attribute.GetName()])))
        if words and found not in (*words, *ENGINES.get(attribute.GetName(), ())):
            yield f"is {found!r}, allowed: {', '.join(words)}"


@rule("echo:FiniteValues", "authored")
def finite_values(_reading: Reading, attribute: Usd.Attribute) -> Iterator[str]:
    """No NaN, no infinity (but for physics' "unlimited"), nothing beyond a thousand million."""
    try:
        found = np.asarray(attribute.Get())
    except (TypeError, ValueError):
        return
    if found.dtype.kind != "f":
        return
    physical = attribute.GetNamespace().startswith("physics")
    bad = np.isnan(found) if physical else ~(np.abs(found) <= LARGEST)
    if bad.any():
        told = f"{found[bad].flat[0]:g}" + (f" ({int(bad.sum())} of {bad.size} numbers)" if bad.size > 1 else "")
        yield f"holds {told}, allowed: -{LARGEST:g} to {LARGEST:g}"


@rule("echo:TransformOps", "prims")
def transform_ops(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Every op that an xformOpOrder names is there; what is not there does not move its prim."""
    attribute = prim.GetAttribute(UsdGeom.Tokens.xformOpOrder)
    order = attribute.Get() if attribute else None
    for name in order if isinstance(order, Iterable) else ():
        if name != RESET and not prim.HasAttribute(str(name).removeprefix(INVERTED)):
            yield f"xformOpOrder names {name!r}, allowed: ops that the prim has"


@rule("echo:AtRest", "authored")
def at_rest(_reading: Reading, attribute: Usd.Attribute) -> Iterator[str]:
    """Nothing moves or changes shape over time: placement, collisions and relations are measured at rest."""
    moves = attribute.GetName().startswith("xformOp") or attribute.GetName() in ("points", "visibility")
    if moves and (count := attribute.GetNumTimeSamples()):
        yield f"has {count} time samples, allowed: one value, without time"


@rule("echo:Variants", "prims")
def variants(_reading: Reading, prim: Usd.Prim) -> Iterator[str]:
    """Every chosen variant exists."""
    if prim.IsInstanceProxy():
        return
    sets = prim.GetVariantSets()
    names = sets.GetNames()
    chosen = {key: word for spec in reversed(prim.GetPrimStack()) for key, word in spec.variantSelections.items()}
    for name, word in chosen.items():
        there = sets.GetVariantSet(name).GetVariantNames() if name in names else []
        if word and word not in there:
            allowed = ", ".join(there) or "none (there is no such variant set)"
            yield f"variant {name!r} is {word!r}, allowed: {allowed}"


@rule("echo:PayloadsLoaded")
def payloads_loaded(reading: Reading) -> Iterator[Finding]:
    """Every payload is loaded: what is not loaded cannot be checked."""
    for prim in Usd.PrimRange.Stage(reading.stage, Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract):
        if prim.HasAuthoredPayloads() and not prim.IsLoaded():
            yield Finding(prim.GetPath(), "its payload is not loaded, so nothing below it was checked; load it first")
