"""OpenUSD's own checker of before 26 (`usdchecker --arkit`): print what it finds in a file as one JSON object.

In Blender's environment: its OpenUSD 25.8 is whole, wheels of usd-core lack the definitions of shaders that it asks.

python usdchecker.py ROOM.usdz [--arkit]
"""

import json
import sys
from pathlib import Path

import bpy

(site,) = Path(bpy.utils.resource_path("LOCAL")).glob("python/lib/python3*/site-packages")
sys.path.insert(0, str(site))

from pxr import UsdUtils  # noqa: E402

checker = UsdUtils.ComplianceChecker(arkit="--arkit" in sys.argv[2:])
checker.CheckCompliance(sys.argv[1])
found = {"errors": checker.GetErrors(), "failed": checker.GetFailedChecks(), "warnings": checker.GetWarnings()}
print(json.dumps(found))
