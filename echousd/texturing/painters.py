"""Scripts that paint the objects of a job one by one: Hunyuan3D-Paint and MVPainter."""

from __future__ import annotations

HUNYUAN = """#!/usr/bin/env bash
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
"""

MVPAINTER = """#!/usr/bin/env bash
# Paints every object of this job with MVPainter (its own environment):
#   MVPAINTER=/path/to/MV-Painter/MVPainter ./run.sh
# then: echousd texture import ROOM.usda THIS_FOLDER
# imgs/ holds pictures of the objects as they are; put others there, of the same names, for other looks.
set -euo pipefail
job=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${MVPAINTER:?set MVPAINTER to the folder with infer_multiview.py}"
turn=${GEO_ROTATION:--90}  # 0 or -90: fronts look along +Z here, as glTF says
python infer_multiview.py --input_glb_dir "$job/glbs" --input_img_dir "$job/imgs" \\
    --output_dir "$job/views" --geo_rotation "$turn"
python infer_paint.py --mv_res_dir "$job/views/mvpainter" --output_dir "$job/results" --geo_rotation "$turn"
"""

SCRIPTS = {"hunyuan": HUNYUAN, "mvpainter": MVPAINTER}
