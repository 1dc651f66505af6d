"""Reading weights loads no compiler."""

from __future__ import annotations

import subprocess
import sys

LOAD = """
import sys
from echomodel.loading import load_model
load_model(None)
print(sorted({"torch._dynamo", "sympy"} & sys.modules.keys()))
"""


def test_no_compiler_is_loaded_with_the_weights():
    done = subprocess.run([sys.executable, "-c", LOAD], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
