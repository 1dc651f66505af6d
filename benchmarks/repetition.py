"""How often the same thing is met in many rooms: small things by shape, pictures, rugs and cushions by their prints.

    python benchmarks/repetition.py ROOMS... [--top 15]

Arguments are folders of rooms. Two things are the same where their label, their shape in a box of one metre (to 2 %)
and the pictures and weaves on them are equal; colours of a harmony count for nothing. Doors and windows are left out.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdSemantics, UsdShade

from echousd.folder.found import room_at

PRINTED = ("picture_", "rug_", "cushion_")  # what the names of prints begin with


def things(stage: Usd.Stage) -> set[tuple[object, ...]]:
    """Label, shape and what is woven or printed of everything below `/Room/Dressing`."""
    found = set()
    root = stage.GetPrimAtPath("/Room/Dressing")
    for prim in root.GetChildren() if root else ():
        points, printed = [], set()
        for mesh in (p for p in Usd.PrimRange(prim, Usd.TraverseInstanceProxies()) if p.IsA(UsdGeom.Mesh)):
            if UsdGeom.Imageable(mesh).ComputePurpose() not in ("default", "render"):
                continue
            points.append(np.array(UsdGeom.Mesh(mesh).GetPointsAttr().Get(), float))
            bound = [mesh, *(subset.GetPrim() for subset in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Mesh(mesh)))]
            looks = [UsdShade.MaterialBindingAPI(one).ComputeBoundMaterial()[0] for one in bound]
            names = [look.GetPrim().GetName() for look in looks if look]
            printed |= {name[name.index(word) :] for name in names for word in PRINTED if word in name}
        if points:
            cloud = np.concatenate(points)
            low, extent = cloud.min(0), np.maximum(np.ptp(cloud, axis=0), 1e-6)
            shape = hash(np.round((cloud - low) / extent / 0.02).astype(int).tobytes()) if not printed else 0
            labels = UsdSemantics.LabelsAPI(prim, "category").GetLabelsAttr().Get() or [prim.GetName()]
            found.add((str(labels[0]), shape, *sorted(printed)))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rooms", nargs="+", type=Path)
    parser.add_argument("--top", type=int, default=15)
    asked = parser.parse_args()
    met: Counter[tuple[object, ...]] = Counter()
    for folder in asked.rooms:
        met.update(things(Usd.Stage.Open(str(room_at(folder)))))
    kinds = Counter(str(key[0]) for key in met)
    print(f"{len(asked.rooms)} rooms, {len(met)} different things of {len(kinds)} kinds\n")
    print("| thing | rooms | different ones of its kind |\n|---|---|---|")
    for (label, shape, *printed), rooms in met.most_common(asked.top):
        name = ", ".join(map(str, printed)) or f"shape {shape & 0xFFFF:04x}"
        print(f"| {label}, {name} | {rooms} | {kinds[str(label)]} |")


if __name__ == "__main__":
    main()
