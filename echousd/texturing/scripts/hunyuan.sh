#!/usr/bin/env bash
# Paints every object of this job with Hunyuan3D-Paint 2.1 (a GPU of 21 GB, its own environment and licence):
#   HUNYUAN=/path/to/Hunyuan3D-2.1 ./run.sh
# then: echousd texture import ROOM.usda THIS_FOLDER
# imgs/ holds pictures of the objects as they are; put others there, of the same names, for other looks.
set -euo pipefail
job=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${HUNYUAN:?set HUNYUAN to the folder of its checkout}"
mkdir -p "$job/results"
JOB="$job" PYTHONPATH=hy3dpaint python - <<'PYTHON'
import json, os
from textureGenPipeline import Hunyuan3DPaintConfig, Hunyuan3DPaintPipeline

job = os.environ["JOB"]
paint = Hunyuan3DPaintPipeline(Hunyuan3DPaintConfig(6, 512))
for thing in json.load(open(f"{job}/job.json"))["objects"]:
    name = thing["name"]
    if os.path.exists(f"{job}/results/{name}.glb"):
        continue
    # use_remesh=False: the triangles have to come back
    paint(mesh_path=f"{job}/glbs/{name}.glb", image_path=f"{job}/imgs/{name}.png",
          output_mesh_path=f"{job}/results/{name}.obj", use_remesh=False, save_glb=True)
PYTHON
