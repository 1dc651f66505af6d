"""`layers/dressing.usda`: everything below `/Room/Dressing`; muted, the room is bare."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdShade

from echousd.dressing.dress import Dressing, write_nodes
from echousd.dressing.setting import Thing
from echousd.layers import assets
from echousd.layers.materials import LOOKS
from echousd.stage.files import new_stage
from echousd.stage.layouts import authored_layouts
from echousd.stage.paths import DRESSING, class_path


def dressing_layer(
    dressing: Dressing, slots: Mapping[str, Mapping[str, Sequence[str]]], looks: Mapping[str, str],
    data: Mapping[str, Any], *, instances: bool = False, taken: Collection[str] = (),
) -> Sdf.Layer:  # fmt: skip
    """The layer; several layouts are variants of `layout`, as in the layer of the layout.

    `dressing`: what is written. `slots`: asset -> name of a part -> its material slots. `looks`: material slot -> name
    of its material in the room. `data`: customLayerData. `instances`: things of one asset are instances of it. `taken`:
    names of the prims of the furniture's relations.
    """
    stage = new_stage("Room", ".usda", data)
    room = stage.OverridePrim("/Room")
    several = len(dressing.layouts) > 1
    users = Counter(dressing.assets[name] for things in dressing.layouts for name in things)
    alike = frozenset(asset for asset, count in users.items() if instances and count > len(dressing.layouts))
    for number in authored_layouts(room, len(dressing.layouts)):
        _write(stage, dressing.layouts[number], dressing, slots, looks, alike)
    for asset in sorted(alike):
        _bind(stage, class_path(asset), slots[asset], looks)
        assets.as_class(stage, asset)

    def finish(layer: Sdf.Layer) -> None:
        for number, things in enumerate(dressing.layouts):
            above = f"/Room{{layout=layout_{number}}}Dressing" if several else DRESSING
            assets.refer(layer, above, {name: dressing.assets[name] for name in things})
        for number, graph in enumerate(dressing.graphs):
            write_nodes(layer, graph, Sdf.Path(f"/Room{{layout=layout_{number}}}" if several else "/Room"), taken)

    return assets.without_stage(stage, finish)


def _write(
    stage: Usd.Stage, things: Mapping[str, Thing], dressing: Dressing, slots: Mapping[str, Mapping[str, Sequence[str]]],
    looks: Mapping[str, str], alike: Collection[str],
) -> None:  # fmt: skip
    group = UsdGeom.Xform.Define(stage, DRESSING).GetPrim()
    Usd.ModelAPI(group).SetKind(Kind.Tokens.group)
    for name, thing in things.items():
        asset, path = dressing.assets[name], f"{DRESSING}/{name}"
        xform = UsdGeom.Xform.Define(stage, path)
        x, y, z = (round(float(v), 5) + 0.0 for v in thing.position)
        xform.AddTranslateOp().Set(Gf.Vec3d(x, y, z))
        xform.AddRotateYOp().Set(round(float(np.degrees(thing.yaw)), 4) + 0.0)
        if asset in alike:
            xform.GetPrim().SetInstanceable(True)
        else:
            _bind(stage, path, slots[asset], looks)


def _bind(stage: Usd.Stage, root: str, slots: Mapping[str, Sequence[str]], looks: Mapping[str, str]) -> None:
    """Bind an asset's parts below a prim, or below its class."""
    for where, slot in assets.slot_paths(root, slots).items():
        over = stage.OverridePrim(where)
        UsdShade.MaterialBindingAPI.Apply(over)
        target = Sdf.Path(f"{LOOKS}/{looks[slot]}")  # another layer defines it
        over.CreateRelationship(UsdShade.Tokens.materialBinding, custom=False).SetTargets([target])
