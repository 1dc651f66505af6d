"""One virtual environment for each client, made once in a cache folder (default `.clients/`, or $ECHOUSD_CLIENTS)."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import echomodel
import echousd

PYTHON_CLIENTS = {
    "blender": ("bpy==5.0.1",),
    "blender42": ("bpy==4.2.0", "numpy<2"),
    "mujoco": ("mujoco-usd==4.0.0",),
    "newton": ("newton[importers]==1.8.0", "warp-lang==1.19.0", "mujoco==4.0.0", "mujoco-warp==4.0.0"),
    "omni": ("omniverse-asset-validator==1.18.0", "usd-core==26.11"),
    "simready": ("simready-validate==2026.8.0", "simready-foundation-tier-core==2026.8.0"),
    "tinyusdz": ("tinyusdz==0.9.4", "numpy"),
    "nvidia": ("usd-validation-nvidia==1.22.0", "usd-core==26.11", "numpy>=2"),
    "ray": ("ray==2.60.0",),
}
# Every OpenUSD since 24.3 that there is a wheel of, but for repetitions of one release.
RELEASES = ("24.3", "24.5", "24.8", "24.11", "25.2.post1", "25.5.1", "25.8", "25.11", "26.3", "26.5", "26.8")
PYTHON_CLIENTS |= {f"usd-{release}": (f"usd-core=={release}",) for release in RELEASES}
WITH_OURS = ("ray",)  # clients that see our own packages, too
NODE = ("three@0.187.0", "gltf-validator@2.0.0-dev.3.10")


def cache() -> Path:
    """The folder that holds the environments."""
    default = Path(__file__).parents[2] / ".clients"
    return Path(os.environ.get("ECHOUSD_CLIENTS", default)).resolve()


def python_of(client: str) -> Path:
    """The interpreter of a client's environment, which is installed at first; raises CalledProcessError."""
    folder = cache() / client
    python, ready = folder / "bin" / "python", folder / ".ready"
    wanted = " ".join(PYTHON_CLIENTS[client])
    if not ready.is_file() or ready.read_text("utf-8") != wanted:
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*install, *PYTHON_CLIENTS[client]], check=True)
        ready.write_text(wanted, "utf-8")
    if client in WITH_OURS:  # written anew each time: another checkout may have made the environment
        (site,) = (folder / "lib").glob("python*/site-packages")
        # an editable install finds our packages by a hook, which another environment does not have
        ours = {str(Path(package.__path__[0]).parent) for package in (echousd, echomodel)}
        (site / "ours.pth").write_text("\n".join([*sorted(ours), *filter(None, sys.path)]) + "\n", "utf-8")
    return python


def three() -> Path:
    """The folder whose `node_modules` holds three.js and Khronos' validator, installed at first with npm.

    Raises CalledProcessError.
    """
    folder = cache() / "three"
    if not all((folder / "node_modules" / name.partition("@")[0]).is_dir() for name in NODE):
        folder.mkdir(parents=True, exist_ok=True)
        install = ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(folder), *NODE]
        subprocess.run(install, check=True, capture_output=True)
    return folder


def run(*command: str | Path, timeout: float = 300.0, accepted: tuple[int, ...] = (0,)) -> str:
    """Standard output of a command without our own Python path; with the errors where several codes are accepted."""
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PXR_PLUGINPATH_NAME")}
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, timeout=timeout, env=environment, check=False
    )
    said = f"{done.stdout}\n{done.stderr}" if len(accepted) > 1 else done.stdout
    assert done.returncode in accepted, f"{command[0]} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}"
    return said
