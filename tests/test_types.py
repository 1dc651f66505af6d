"""Types: mypy finds nothing. It is a test, so that the other core is not idle for the minute that it takes."""

import subprocess
import sys
from pathlib import Path

# Without searches for garbage, of which it makes little: a ninth of its time.
MYPY = "import gc, runpy; gc.disable(); gc.enable = lambda: None; runpy.run_module('mypy', run_name='__main__')"


def test_types_agree():
    command = [sys.executable, "-c", MYPY]
    done = subprocess.run(command, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
