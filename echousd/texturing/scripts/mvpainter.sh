#!/usr/bin/env bash
# Paints every object of this job with MVPainter (its own environment):
#   MVPAINTER=/path/to/MV-Painter/MVPainter ./run.sh
# then: echousd texture import ROOM.usda THIS_FOLDER
# imgs/ holds pictures of the objects as they are; put others there, of the same names, for other looks.
set -euo pipefail
job=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${MVPAINTER:?set MVPAINTER to the folder with infer_multiview.py}"
turn=${GEO_ROTATION:--90}  # 0 or -90: fronts look along +Z here, as glTF says
python infer_multiview.py --input_glb_dir "$job/glbs" --input_img_dir "$job/imgs" \
    --output_dir "$job/views" --geo_rotation "$turn"
python infer_paint.py --mv_res_dir "$job/views/mvpainter" --output_dir "$job/results" --geo_rotation "$turn"
