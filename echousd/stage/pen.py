"""Prims of a layer authored through Sdf alone: no stage composes what is being written.

Properties are called as usda spells them: `uniform token purpose`, `rel material:binding`, `custom float[] mine`,
`color3f inputs:diffuseColor.connect`. The layouts of a room are variants of a set: written here, and listed.
"""

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import numpy as np
from pxr import Sdf, Usd

from echousd.stage.paths import ROOM

NOTHING: Mapping[str, Any] = {}
UNIFORM = Sdf.VariabilityUniform


class Pen:
    """Writes prims of a layer, given by their paths; what is below `scope` goes into the variant `into`, if any."""

    def __init__(self, layer: Sdf.Layer, scope: Sdf.Path | str = "/", into: Sdf.Path | None = None) -> None:
        self.layer, self.scope, self.into = layer, Sdf.Path(scope), into

    @classmethod
    def blank(cls, default_prim: str, kind: str = ".usda", data: Mapping[str, Any] = NOTHING) -> "Pen":
        """A pen for a new layer of a kind of file, with customLayerData and the metadata that all our layers carry."""
        layer = Sdf.Layer.CreateAnonymous(kind)
        for name, value in (("upAxis", "Y"), ("metersPerUnit", 1.0), ("kilogramsPerUnit", 1.0)):
            layer.pseudoRoot.SetInfo(name, value)
        layer.defaultPrim = default_prim
        if data:
            layer.customLayerData = dict(data)
        return cls(layer)

    def over(
        self, path: str | Sdf.Path, values: Mapping[str, Any] = NOTHING, apis: Iterable[str] = (), **about: Any
    ) -> Sdf.PrimSpec:
        """Add opinions to the prim at a path: properties, applied schemas, metadata; see `say`."""
        return say(Sdf.CreatePrimInLayer(self.layer, self._at(path)), values, apis, **about)

    def define(
        self, path: str | Sdf.Path, type_name: str, values: Mapping[str, Any] = NOTHING, apis: Iterable[str] = (),
        **about: Any,
    ) -> Sdf.PrimSpec:  # fmt: skip
        """Define a prim of a type, and those above it; opinions as for `over`."""
        spec = self.over(path, values, apis, **about)
        spec.typeName = type_name
        above, found = Sdf.Path(path), spec
        while found.specifier == Sdf.SpecifierOver and above.IsPrimPath():
            found.specifier, above = Sdf.SpecifierDef, above.GetParentPath()
            found = self.layer.GetPrimAtPath(self._at(above))
        return spec

    def _at(self, path: str | Sdf.Path) -> str | Sdf.Path:
        return path if self.into is None else Sdf.Path(path).ReplacePrefix(self.scope, self.into)

    def label(self, path: str, **words: str) -> None:
        """Say what a prim is, by taxonomy."""
        values = {f"token[] semantics:labels:{taxonomy}": [word] for taxonomy, word in words.items()}
        self.over(path, values, [f"SemanticsLabelsAPI:{taxonomy}" for taxonomy in words])

    def bind(self, path: str, material: str) -> None:
        """Bind a material, of whatever layer; three.js's parser would lose a `custom rel`."""
        self.over(path, {"rel material:binding": material}, ["MaterialBindingAPI"])

    def variants(self, path: str, name: str, words: Iterable[str], chosen: str | None) -> "dict[str, Pen]":
        """A pen for each variant of a set on a prim; `chosen`: what is seen, None = another layer says it."""
        spec = self.over(path)
        made = spec.variantSets.get(name) or Sdf.VariantSetSpec(spec, name)
        listed = spec.variantSetNameList
        listed.prependedItems = [*(word for word in listed.prependedItems if word != name), name]
        if chosen is not None:
            spec.variantSelections[name] = chosen
        pens = {word: Pen(self.layer, path, spec.path.AppendVariantSelection(name, word)) for word in words}
        for word in pens:
            if word not in made.variants:
                Sdf.VariantSpec(made, word)
        return pens


def say(spec: Sdf.PrimSpec, values: Mapping[str, Any], apis: Iterable[str] = (), **about: Any) -> Sdf.PrimSpec:
    """Author properties, applied schemas and metadata of a prim.

    `values`: property as usda spells it -> default value (None = the property alone), or path or paths that it points
    to. `about`: metadata by name.
    """
    for words, value in values.items():
        name, kind, held, variability, custom, connects = _parsed(words)
        if kind is None:
            relate(spec, name, *([value] if isinstance(value, str | Sdf.Path) else value), custom=custom)
            continue
        attribute = spec.properties.get(name) or Sdf.AttributeSpec(spec, name, kind, variability, custom)
        if connects:
            attribute.connectionPathList.explicitItems = [Sdf.Path(value)]
        elif value is not None:  # USD takes four times as long to find out how an array of numpy or a tuple fits
            of = held.FromNumpy(value) if isinstance(value, np.ndarray) else value
            attribute.default = held(*value) if isinstance(value, tuple) and not kind.isArray else of
    if apis:
        apply_apis(spec, *apis)
    for name, value in about.items():
        spec.SetInfo(name, value)
    return spec


@cache
def _parsed(words: str) -> tuple[str, Sdf.ValueTypeName | None, Any, Sdf.Variability, bool, bool]:
    """Name, type (None = a relationship), class and variability of a property, whether it is custom, a connection."""
    *before, name = words.split()
    name = name.removesuffix(".connect")
    kind = None if before[-1] == "rel" else Sdf.ValueTypeNames.Find(before[-1])
    variability = UNIFORM if "uniform" in before else Sdf.VariabilityVarying
    return name, kind, kind and kind.type.pythonClass, variability, "custom" in before, words.endswith(".connect")


def ops(**steps: tuple[str, Any]) -> dict[str, Any]:
    """The transform of a prim, for `say`: op -> its type and value, in order, and the order itself."""
    values = {f"{kind} xformOp:{op}": value for op, (kind, value) in steps.items()}
    return {**values, "uniform token[] xformOpOrder": [f"xformOp:{op}" for op in steps]}


def apply_apis(spec: Sdf.PrimSpec, *names: str) -> None:
    """Add schemas to those that a prim applies, where they are not among them."""
    listed = spec.GetInfo("apiSchemas")  # an empty list where none is authored
    missing = [name for name in names if name not in listed.GetAddedOrExplicitItems()]
    if not missing:
        return
    if listed.isExplicit:
        listed.explicitItems = [*listed.explicitItems, *missing]
    else:
        listed.prependedItems = [*listed.prependedItems, *missing]
    spec.SetInfo("apiSchemas", listed)


def relate(spec: Sdf.PrimSpec, name: str, *targets: Sdf.Path | str, custom: bool = False) -> None:
    """Author a relationship with exactly these targets."""
    relationship = spec.properties.get(name) or Sdf.RelationshipSpec(spec, name, custom, UNIFORM)
    relationship.targetPathList.ClearEditsAndMakeExplicit()  # no target is an opinion as well
    relationship.targetPathList.explicitItems = [Sdf.Path(target) for target in targets]


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
