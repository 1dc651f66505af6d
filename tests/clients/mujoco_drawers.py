"""Load a room's furniture with its joints in MuJoCo, let it settle, pull every drawer and door; print one JSON object.

python mujoco_drawers.py ROOM.usda FLAT.usdc
"""

import json
import os
import sys
from pathlib import Path

import mujoco
import numpy as np
from mujoco._usd import register_plugins
from pxr import Usd

PULL, SECONDS = 8.0, 2.0  # newtons or newton metres

register_plugins()
os.chdir(Path(sys.argv[2]).parent)  # where MuJoCo leaves its log of warnings
stage = Usd.Stage.Open(sys.argv[1])
for prim in stage.GetPrimAtPath("/Room/Objects").GetChildren():
    sets = prim.GetVariantSets()
    if "articulation" in sets.GetNames():
        sets.SetSelection("articulation", "articulated")
for prim in stage.Traverse():
    if prim.GetTypeName() == "Shader" and prim.GetAttribute("info:id").Get() == "UsdUVTexture":
        prim.SetActive(False)  # MuJoCo 4.0 reads no JPEG and refuses the room
stage.Flatten().Export(sys.argv[2])
model = mujoco.MjSpec.from_file(sys.argv[2]).compile()
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
before = data.xpos.copy()
while data.time < SECONDS:
    mujoco.mj_step(model, data)
moved = np.linalg.norm(data.xpos - before, axis=1)
names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, k) for k in range(model.nbody)]
opened = {}
for joint in range(model.njnt):
    if model.jnt_type[joint] not in (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)):
        continue
    mujoco.mj_resetData(model, data)
    while data.time < SECONDS:
        data.qfrc_applied[model.jnt_dofadr[joint]] = PULL
        mujoco.mj_step(model, data)
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    place = float(data.qpos[model.jnt_qposadr[joint]])
    opened[name] = {"to": place, "limit": model.jnt_range[joint].tolist()}
moved = {name: float(far) for name, far in zip(names[1:], moved[1:], strict=True)}
sys.stdout.write(json.dumps({"moved": moved, "opened": opened}))
