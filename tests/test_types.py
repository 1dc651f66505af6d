"""Types: mypy finds nothing. It is a test, so that the other core is not idle for the minute that it takes."""

import subprocess
import sys
from pathlib import Path


def test_types_agree():
    command = [sys.executable, "-m", "mypy"]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
