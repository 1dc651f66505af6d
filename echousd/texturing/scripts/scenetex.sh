#!/usr/bin/env bash
# Paints this job with SceneTex (a GPU of 48 GB, its own environment; its licence is CC BY-NC-SA):
#   SCENETEX=/path/to/SceneTex ./run.sh
# then: echousd texture import ROOM.usda THIS_FOLDER
set -euo pipefail
job=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
cd "${SCENETEX:?set SCENETEX to the folder of its checkout}"

# It reads scenes below its own folder.
mkdir -p data/scenes
ln -sfn "$job"/data/scenes/@ROOM@ data/scenes/@ROOM@
# The weights that it names have moved on their hub.
sed -i 's#"runwayml/stable-diffusion-v1-5"#"stable-diffusion-v1-5/stable-diffusion-v1-5"#' models/modules/guidance.py
# It opens a picture that its repository does not hold.
mkdir -p samples/textures
[ -e samples/textures/dummy.png ] || python -c "from PIL import Image as I; I.new('RGB', (64, 64)).save(
    'samples/textures/dummy.png')"
# It stacks as many anchors from every object: no more than the fewest visible texels that it accepts.
sed 's/^num_anchors:.*/num_anchors: @ANCHORED@/' config/template.yaml > "$job/config.yaml"

# It logs in to a service: not needed. The run's folder holds our texture coordinates already (meshes/).
WANDB_MODE=offline python scripts/train_texture.py --config "$job/config.yaml" --stamp @STAMP@ \
    --log_dir "$job/@OUTPUTS@" --prompt @PROMPT@ --scene_id @SCENE@
