"""Import a stage in Blender's Python module (bpy) and print what arrived, one JSON object for each Blender object.

python blender_import.py ROOM.usda
"""

import json
import sys

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.world = bpy.data.worlds.new("World")  # as in Blender's own new files; it receives the dome light
bpy.ops.wm.usd_import(filepath=sys.argv[-1])
depsgraph = bpy.context.evaluated_depsgraph_get()
for thing in bpy.data.objects:
    mesh = thing.data if thing.type == "MESH" else None
    corners = [thing.matrix_world @ vertex.co for vertex in mesh.vertices] if mesh else []
    print(
        json.dumps(
            {
                "name": thing.name,
                "type": thing.type,
                "parent": thing.parent.name if thing.parent else None,
                "position": [round(x, 5) for x in thing.matrix_world.translation],
                "low": [round(min(c[i] for c in corners), 5) for i in range(3)] if corners else None,
                "high": [round(max(c[i] for c in corners), 5) for i in range(3)] if corners else None,
                "faces": len(mesh.polygons) if mesh else 0,
                "uv_layers": [layer.name for layer in mesh.uv_layers] if mesh else [],
                "uv_spread": [
                    round(
                        max(uv.vector[i] for uv in mesh.uv_layers[0].uv)
                        - min(uv.vector[i] for uv in mesh.uv_layers[0].uv),
                        4,
                    )
                    for i in range(2)
                ]
                if mesh and mesh.uv_layers and len(mesh.uv_layers[0].uv)
                else None,
                "materials": [material.name for material in mesh.materials if material] if mesh else [],
                "hidden": thing.hide_render,
                "light": list(thing.data.color) if thing.type == "LIGHT" else None,
                "lens": [thing.data.lens, thing.data.sensor_width] if thing.type == "CAMERA" else None,
            }
        )
    )
