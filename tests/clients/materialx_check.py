"""Is every MaterialX node of a stage one of the standard library's, with its inputs? `materialx_check.py ROOM.usda`"""

import json
import sys

import MaterialX
from pxr import Usd, UsdShade

TYPES = {
    "color3": "color3f",
    "vector3": "float3",
    "vector2": "float2",
    "float": "float",
    "filename": "asset",
    "string": "string",
}
library = MaterialX.createDocument()
MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library)
nodes, wrong = 0, []
stage = Usd.Stage.Open(sys.argv[1])
for prim in stage.Traverse():
    shader = UsdShade.Shader(prim)
    if not shader or not shader.GetShaderId().startswith("ND_"):
        continue
    nodes += 1
    definition = library.getNodeDef(shader.GetShaderId())
    if definition is None:
        wrong.append([str(prim.GetPath()), shader.GetShaderId()])
        continue
    for entry in shader.GetInputs():
        known = definition.getActiveInput(entry.GetBaseName())
        if known is None or TYPES.get(known.getType()) != str(entry.GetTypeName()):
            wrong.append([str(entry.GetAttr().GetPath()), str(entry.GetTypeName())])
print(json.dumps({"nodes": nodes, "wrong": wrong, "version": MaterialX.getVersionString()}))
