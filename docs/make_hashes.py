"""requirements.txt: every distribution that ships with the package, by version and hash, for this Python and system.

Resolves the dependencies of pyproject.toml at the versions of constraints.txt with pip, which downloads no package for
that where its index tells what each one needs.
"""

from __future__ import annotations

import json
import platform
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

TOP = Path(__file__).resolve().parents[1]
FILE = TOP / "requirements.txt"
HEAD = """\
# What a room is made with, by its hashes: {python} on {system}; made by `make hashes` from constraints.txt.
#   pip install --require-hashes -r requirements.txt && pip install --no-deps --no-build-isolation .
"""


def lines() -> list[str]:
    """`name==version --hash=sha256:...` of each distribution, sorted; raises CalledProcessError where pip fails."""
    project = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))
    wanted = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        words = ["--isolated", "install", "--dry-run", "--ignore-installed", "--quiet", "--only-binary", ":all:"]
        words += ["--report", str(report), "-c", str(TOP / "constraints.txt")]
        subprocess.run([sys.executable, "-m", "pip", *words, *wanted], check=True)
        found = json.loads(report.read_text("utf-8"))["install"]
    told = []
    for entry in found:
        name, version = entry["metadata"]["name"], entry["metadata"]["version"]
        sha256 = entry["download_info"]["archive_info"]["hashes"]["sha256"]
        told.append(f"{name.lower().replace('_', '-')}=={version} --hash=sha256:{sha256}")
    return sorted(told)


def main() -> None:
    """Write the file."""
    python = f"{platform.python_implementation()} {'.'.join(platform.python_version_tuple()[:2])}"
    head = HEAD.format(python=python, system=f"{platform.system()} {platform.machine()}")
    FILE.write_text(head + "\n".join(lines()) + "\n", "utf-8")


if __name__ == "__main__":
    main()
