"""Read a room with any OpenUSD, without echousd or its schema plugin, and print what is there as one JSON object.

python pxr_read.py ROOM.usda
"""

import json
import sys

from pxr import Usd, UsdGeom, UsdPhysics, UsdShade

stage = Usd.Stage.Open(sys.argv[1])
cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
objects, relations, unbound = {}, [], []
for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
    if "EchoNodeAPI" in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
        box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
        objects[prim.GetName()] = {
            "labels": list(prim.GetAttribute("semantics:labels:category").Get() or []),
            "low": list(box.GetMin()),
            "high": list(box.GetMax()),
            "body": prim.HasAPI(UsdPhysics.RigidBodyAPI),
        }
    if prim.GetTypeName() == "EchoRelation":
        ends = [prim.GetRelationship(f"echo:{end}").GetTargets()[0].name for end in ("subject", "object")]
        relations.append([ends[0], prim.GetAttribute("echo:predicate").Get(), ends[1]])
    if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
        parts = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets() or [prim]
        for part in parts:
            part = part.GetPrim() if hasattr(part, "GetPrim") else part
            if not UsdShade.MaterialBindingAPI(part).ComputeBoundMaterial()[0]:
                unbound.append(str(part.GetPath()))
print(
    json.dumps(
        {
            "version": list(Usd.GetVersion()),
            "composition_errors": [str(error) for error in getattr(stage, "GetCompositionErrors", list)()],
            "up_axis": str(UsdGeom.GetStageUpAxis(stage)),
            "objects": objects,
            "relations": relations,
            "unbound": unbound,
        }
    )
)
