"""Take a room apart: its meshes with trimesh, its stage with pxr, and a layer of your own on top.

python samples/use_meshes.py [FOLDER]
"""

import sys
from pathlib import Path

from pxr import Usd, UsdGeom

import echousd

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out/living_room")
room = echousd.generate(Path(__file__).parent / "living_room.usda", seed=3)
for name, mesh in room.meshes.items():
    print(f"{name:>14}: {len(mesh.faces)} faces, {mesh.volume * 1000:.0f} litres, closed: {mesh.is_watertight}")

root = room.save(folder)
mine = folder / "mine.usda"  # stays as it is when the room is generated again
mine.unlink(missing_ok=True)
stage = Usd.Stage.CreateNew(str(mine))
stage.GetRootLayer().subLayerPaths = [f"./{root.name}"]
UsdGeom.SetStageMetersPerUnit(stage, 1.0)  # USD asks the strongest layer alone
UsdGeom.SetStageUpAxis(stage, "Y")
stage.SetDefaultPrim(stage.GetPrimAtPath("/Room"))
ball = UsdGeom.Sphere.Define(stage, "/Room/Ball")
ball.CreateRadiusAttr(0.12)
ball.AddTranslateOp().Set((0.0, 0.12, 0.0))
stage.Save()
print("open", mine)
