"""Load a flat room in tinyusdz and print its meshes and materials as one JSON object.

python tinyusdz_load.py ROOM.usdc
"""

import json
import sys

import tinyusdz

found = tinyusdz.tydra.convert_to_render_scene(tinyusdz.load(sys.argv[1]))
scene = found[0] if isinstance(found, tuple) else found
print(json.dumps({"meshes": len(scene.meshes()), "materials": len(scene.materials())}))
