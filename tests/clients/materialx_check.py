"""What MaterialX itself makes of a stage's networks: `materialx_check.py ROOM.usda`, JSON on standard output.

Every node has to be one of the standard library's, with its inputs; every material is put together as a MaterialX
document, validated, and turned into shaders of four languages by MaterialX's own generators.
"""

import json
import sys

import MaterialX
from MaterialX import PyMaterialXGenGlsl, PyMaterialXGenMdl, PyMaterialXGenOsl, PyMaterialXGenShader
from pxr import Usd, UsdShade

TYPES = {
    "color3": "color3f",
    "vector3": "float3",
    "vector2": "float2",
    "float": "float",
    "filename": "asset",
    "string": "string",
}
GENERATORS = {
    "glsl": PyMaterialXGenGlsl.GlslShaderGenerator,
    "essl": PyMaterialXGenGlsl.EsslShaderGenerator,
    "osl": PyMaterialXGenOsl.OslShaderGenerator,
    "mdl": PyMaterialXGenMdl.MdlShaderGenerator,
}


def strange(shader, library):
    """What the library does not know of a node: lists of a path and a type."""
    definition = library.getNodeDef(shader.GetShaderId())
    if definition is None:
        return [[str(shader.GetPath()), shader.GetShaderId()]]
    wrong = []
    for entry in shader.GetInputs():
        known = definition.getActiveInput(entry.GetBaseName())
        if known is None or TYPES.get(known.getType()) != str(entry.GetTypeName()):
            wrong.append([str(entry.GetAttr().GetPath()), str(entry.GetTypeName())])
    return wrong


def text_of(entry):
    """The value of an input as MaterialX writes it."""
    value = entry.Get()
    if str(entry.GetTypeName()) == "asset":
        return value.path
    return ", ".join(str(v) for v in value) if hasattr(value, "__len__") and not isinstance(value, str) else str(value)


def written(shader, document, library, made):
    """The node of a shader in a document, and before it those that it listens to."""
    name = shader.GetPrim().GetName()
    if name in made:
        return made[name]
    definition = library.getNodeDef(shader.GetShaderId())
    node = made[name] = document.addNode(definition.getNodeString(), name, definition.getType())
    node.setNodeDefString(definition.getName())
    for entry in shader.GetInputs():
        word = entry.GetBaseName()
        added = node.addInput(word, definition.getActiveInput(word).getType())
        sources, _ = entry.GetConnectedSources()
        if sources:
            source = written(UsdShade.Shader(sources[0].source.GetPrim()), document, library, made)
            added.setNodeName(source.getName())
        else:
            added.setValueString(text_of(entry))
            if entry.GetAttr().HasColorSpace():
                added.setColorSpace(entry.GetAttr().GetColorSpace())
    return node


library = MaterialX.createDocument()
MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), MaterialX.getDefaultDataSearchPath(), library)
nodes, wrong, shaders, invalid = 0, [], dict.fromkeys(GENERATORS, 0), []
stage = Usd.Stage.Open(sys.argv[1])
for prim in stage.Traverse():
    shader = UsdShade.Shader(prim)
    if shader and shader.GetShaderId().startswith("ND_"):
        nodes += 1
        wrong += strange(shader, library)
    output = UsdShade.Material(prim).GetSurfaceOutput("mtlx") if prim.IsA(UsdShade.Material) else None
    if wrong or not output or not output.HasConnectedSource():
        continue
    document = MaterialX.createDocument()
    document.importLibrary(library)
    surface = written(UsdShade.Shader(output.GetConnectedSources()[0][0].source.GetPrim()), document, library, {})
    material = document.addMaterialNode(f"material_{prim.GetName()}", surface)
    valid, said = document.validate()
    if not valid:
        invalid.append([str(prim.GetPath()), said])
        continue
    for language, kind in GENERATORS.items():
        generator = kind.create()
        context = PyMaterialXGenShader.GenContext(generator)
        context.registerSourceCodeSearchPath(MaterialX.getDefaultDataSearchPath())
        try:
            made = generator.generate(prim.GetName(), material, context)
        except Exception as error:
            invalid.append([str(prim.GetPath()), f"{language}: {error}"])
        else:
            shaders[language] += len(made.getSourceCode(PyMaterialXGenShader.PIXEL_STAGE)) > 1000
said = {"nodes": nodes, "wrong": wrong, "shaders": shaders, "invalid": invalid, "version": MaterialX.getVersionString()}
print(json.dumps(said))
