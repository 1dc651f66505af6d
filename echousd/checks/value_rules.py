"""Rules on values, whatever they describe: of their type, finite, at rest, of variants and payloads that are there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom

from echomodel.vocabulary import vocabulary
from echousd.checks.findings import Finding, Rule
from echousd.checks.reading import Reading
from echousd.stage.files import said
from echousd.stage.values import LARGEST, misfit, shown

WRAPS = ("black", "clamp", "repeat", "mirror", "useMetadata")
WORDS = {"inputs:sourceColorSpace": ("raw", "sRGB", "auto"), "inputs:wrapS": WRAPS, "inputs:wrapT": WRAPS}
ENGINES = {"physics:approximation": ("sdf", "sphereFill", "convexMeshSimplification")}  # words that only some know
SPOKEN = {"echo:predicate": "predicates", "echo:roomType": "room_types"}
INVERTED = "!invert!"
RESET = "!resetXformStack!"


def value_types(reading: Reading) -> Iterator[Finding]:
    """Every value can be read is of the type of its attribute and one of its words: clients read nothing, or crash."""
    for attribute in reading.authored:
        try:
            found = attribute.Get()
        except Tf.ErrorException as error:
            yield Finding(attribute.GetPath(), f"a value that cannot be read: {said(error)}")
            continue
        if misfit(attribute.GetTypeName(), found):
            yield Finding(attribute.GetPath(), f"holds {shown(found)}, allowed: {attribute.GetTypeName()}")
        elif isinstance(found, str) and attribute.GetTypeName() == Sdf.ValueTypeNames.Token:
            words = attribute.GetMetadata("allowedTokens") or WORDS.get(attribute.GetName())
            if words and attribute.GetName() in SPOKEN:  # the schema may be older than the words
                words = (*words, *(row.name for row in getattr(vocabulary(), SPOKEN[attribute.GetName()])))
            if words and found not in (*words, *ENGINES.get(attribute.GetName(), ())):
                yield Finding(attribute.GetPath(), f"is {found!r}, allowed: {', '.join(words)}")


def finite_values(reading: Reading) -> Iterator[Finding]:
    """No NaN, no infinity (but for physics' "unlimited"), nothing beyond a thousand million."""
    for attribute in reading.authored:
        try:
            found = np.asarray(attribute.Get())
        except (Tf.ErrorException, TypeError, ValueError):
            continue
        if found.dtype.kind != "f":
            continue
        physical = attribute.GetNamespace().startswith("physics")
        bad = np.isnan(found) if physical else ~(np.abs(found) <= LARGEST)
        if bad.any():
            told = f"{found[bad].flat[0]:g}" + (f" ({int(bad.sum())} of {bad.size} numbers)" if bad.size > 1 else "")
            yield Finding(attribute.GetPath(), f"holds {told}, allowed: -{LARGEST:g} to {LARGEST:g}")


def transform_ops(reading: Reading) -> Iterator[Finding]:
    """Every op that an xformOpOrder names is there; what is not there does not move its prim."""
    for prim in reading.prims:
        attribute = prim.GetAttribute(UsdGeom.Tokens.xformOpOrder)
        try:
            order = attribute.Get() if attribute else None
        except Tf.ErrorException:
            continue
        if not isinstance(order, tuple | list) and not hasattr(order, "__iter__"):
            continue
        for name in order or ():
            if name != RESET and not prim.HasAttribute(str(name).removeprefix(INVERTED)):
                yield Finding(prim.GetPath(), f"xformOpOrder names {name!r}, allowed: ops that the prim has")


def at_rest(reading: Reading) -> Iterator[Finding]:
    """Nothing moves or changes shape over time: placement, collisions and relations are measured at rest."""
    for attribute in reading.authored:
        name = attribute.GetName()
        moves = name.startswith("xformOp") or name in ("points", "visibility")
        if moves and attribute.GetNumTimeSamples():
            count = attribute.GetNumTimeSamples()
            yield Finding(attribute.GetPath(), f"has {count} time samples, allowed: one value, without time")


def variants(reading: Reading) -> Iterator[Finding]:
    """Every chosen variant exists."""
    for prim in reading.prims:
        if prim.IsInstanceProxy():
            continue
        sets = prim.GetVariantSets()
        names = sets.GetNames()
        chosen = {key: word for spec in reversed(prim.GetPrimStack()) for key, word in spec.variantSelections.items()}
        for name, word in chosen.items():
            there = sets.GetVariantSet(name).GetVariantNames() if name in names else []
            if word and word not in there:
                allowed = ", ".join(there) or "none (there is no such variant set)"
                yield Finding(prim.GetPath(), f"variant {name!r} is {word!r}, allowed: {allowed}")


def payloads_loaded(reading: Reading) -> Iterator[Finding]:
    """Every payload is loaded: what is not loaded cannot be checked."""
    for prim in Usd.PrimRange.Stage(reading.stage, Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract):
        if prim.HasAuthoredPayloads() and not prim.IsLoaded():
            yield Finding(prim.GetPath(), "its payload is not loaded, so nothing below it was checked; load it first")


RULES = (
    Rule("echo:ValueTypes", "Every value is of the type of its attribute.", value_types),
    Rule("echo:FiniteValues", "No value is NaN, infinite or beyond 1e9.", finite_values),
    Rule("echo:TransformOps", "The ops that an xformOpOrder names are there.", transform_ops),
    Rule("echo:AtRest", "No time samples move or reshape anything.", at_rest),
    Rule("echo:Variants", "Chosen variants exist.", variants),
    Rule("echo:PayloadsLoaded", "Payloads are loaded.", payloads_loaded),
)
