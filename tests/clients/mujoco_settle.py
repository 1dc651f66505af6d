"""Load flat rooms through MuJoCo's own importer of USD, simulate two seconds, print how far each body went as JSON.

python mujoco_settle.py ROOM.usdc ...       (`echousd export ROOM.usda -o ROOM.usdc --no-pictures`)
"""

import json
import os
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from mujoco._usd import register_plugins

SECONDS, STEP = 2.0, 0.004

register_plugins()
files = [Path(name).resolve() for name in sys.argv[1:]]
os.chdir(tempfile.mkdtemp())  # where MuJoCo leaves its log of warnings
for file in files:
    spec = mujoco.MjSpec.from_file(str(file))
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # the pyramid lets things creep
    spec.option.impratio = 10
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    places, turns = data.xpos.copy(), data.xmat.reshape(-1, 3, 3).copy()
    while data.time < SECONDS:
        mujoco.mj_step(model, data)
    moved = {}
    for body in range(1, model.nbody):
        if model.body_jntnum[body] == 0:
            continue
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)
        shift = float(np.linalg.norm(data.xpos[body] - places[body]))
        cosine = (np.trace(data.xmat[body].reshape(3, 3) @ turns[body].T) - 1) / 2
        moved[name] = [shift, float(np.degrees(np.arccos(np.clip(cosine, -1, 1)))), float(model.body_mass[body])]
    print(json.dumps({"file": str(file), "moved": moved}), flush=True)
