"""Load a room's furniture with its joints in Newton, let it settle, pull every drawer and door; print one JSON object.

python newton_drawers.py ROOM.usda FLAT.usdc

Contacts as in `newton_settle.py`, stiffer stops: by its defaults a drawer goes 8 cm beyond them and springs back.
What opens begins each time as it settled; told is the furthest that it was.
"""

import json
import sys

import newton
import numpy as np
import warp
from pxr import Usd

PULL, SECONDS, STEP = 8.0, 2.0, 0.004  # newtons or newton metres

warp.config.quiet = True
stage = Usd.Stage.Open(sys.argv[1])
for prim in stage.GetPrimAtPath("/Room/Objects").GetChildren():
    sets = prim.GetVariantSets()
    if "articulation" in sets.GetNames():
        sets.SetSelection("articulation", "articulated")
stage.Flatten().Export(sys.argv[2])
builder = newton.ModelBuilder()
builder.rigid_gap = 0.0
builder.default_joint_cfg.limit_ke, builder.default_joint_cfg.limit_kd = 1e5, 1e3
builder.add_usd(sys.argv[2])
model = builder.finalize(device="cpu")
solver = newton.solvers.SolverMuJoCo(
    model, use_mujoco_cpu=True, integrator="implicitfast", cone="elliptic", impratio=10.0, enable_multiccd=True
)


def simulated(start: "newton.State", pull: np.ndarray) -> tuple["newton.State", np.ndarray]:
    """The state after some seconds under forces (dofs,) of the joints, and the furthest that each coordinate was."""
    now, after, control = model.state(), model.state(), model.control()
    now.assign(start)
    control.joint_f.assign(pull.astype(np.float32))
    furthest = now.joint_q.numpy().copy()
    for _ in range(round(SECONDS / STEP)):
        now.clear_forces()
        solver.step(now, after, control, None, STEP)
        now, after = after, now
        furthest = np.maximum(furthest, now.joint_q.numpy())
    return now, furthest


state = model.state()
newton.eval_fk(model, model.joint_q, model.joint_qd, state)
dofs = model.joint_dof_count
rest, _ = simulated(state, np.zeros(dofs))
moved = np.linalg.norm(rest.body_q.numpy()[:, :3] - state.body_q.numpy()[:, :3], axis=1)
kinds, first = model.joint_type.numpy(), model.joint_q_start.numpy()
dof, low, high = model.joint_qd_start.numpy(), model.joint_limit_lower.numpy(), model.joint_limit_upper.numpy()
opened = {}
for joint, kind in enumerate(kinds):
    if kind not in (int(newton.JointType.PRISMATIC), int(newton.JointType.REVOLUTE)):
        continue
    _, furthest = simulated(rest, PULL * (np.arange(dofs) == dof[joint]))
    limit = [float(low[dof[joint]]), float(high[dof[joint]])]
    opened[model.joint_label[joint]] = {"to": float(furthest[first[joint]]), "limit": limit}
json.dump({"moved": dict(zip(model.body_label, moved.tolist(), strict=True)), "opened": opened}, sys.stdout)
