"""Load rooms in Newton (its MuJoCo solver on the CPU), simulate two seconds, print how far each body went as JSON.

python newton_settle.py ROOM.usda ...

Newton turns off what MuJoCo has on by itself, several points of contact for a pair of convex pieces (`multiccd`), and
looks for contacts 10 cm ahead: so set, what stands on one point creeps and turns. Here both are as in MuJoCo.
"""

import json
import sys

import newton
import numpy as np
import warp

SECONDS, STEP = 2.0, 0.004

warp.config.quiet = True
for file in sys.argv[1:]:
    builder = newton.ModelBuilder()
    builder.rigid_gap = 0.0
    builder.add_usd(file)
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverMuJoCo(
        model, use_mujoco_cpu=True, integrator="implicitfast", cone="elliptic", impratio=10.0, enable_multiccd=True
    )  # the pyramid, its default, lets things creep
    now, after, control = model.state(), model.state(), model.control()
    newton.eval_fk(model, model.joint_q, model.joint_qd, now)
    start = now.body_q.numpy().copy()
    for _ in range(round(SECONDS / STEP)):
        now.clear_forces()
        solver.step(now, after, control, None, STEP)
        now, after = after, now
    end = now.body_q.numpy()
    moved = {}
    for body, label in enumerate(model.body_label):
        shift = float(np.linalg.norm(end[body, :3] - start[body, :3]))
        turn = float(np.degrees(2 * np.arccos(min(1.0, abs(float(end[body, 3:] @ start[body, 3:]))))))
        moved[label] = [shift, turn, float(model.body_mass.numpy()[body])]
    print(json.dumps({"file": file, "moved": moved}), flush=True)
