"""Where furniture meshes are found: libraries, packages of libraries, folders, a package of Debian's."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from echomodel.data.catalogues import MESH_FILES, MeshEntry, read_folder, read_library

PACKAGE = "sweethome3d-furniture"


def fetched_package(out: Path) -> Path:
    """Download the Debian package into OUT/source; raises ValueError where apt is missing or fails."""
    folder = out / "source"
    folder.mkdir(exist_ok=True)
    have = sorted(folder.glob(f"{PACKAGE}_*.deb"))
    if have:
        return have[-1]
    if shutil.which("apt-get") is None:
        raise ValueError(f"--debian needs apt-get; elsewhere download {PACKAGE}_1.8-1_all.deb and name it as a source")
    done = subprocess.run(["apt-get", "download", PACKAGE], cwd=folder, capture_output=True, text=True, check=False)
    found = sorted(folder.glob(f"{PACKAGE}_*.deb"))
    if done.returncode or not found:
        raise ValueError(f"apt-get download {PACKAGE} failed: {(done.stderr.strip() or 'no file').splitlines()[-1]}")
    return found[-1]


def entries_of(path: Path, out: Path, more: tuple[str, ...] = ()) -> list[MeshEntry]:
    """Models of one source: a library, a package of libraries, or a folder.

    Arguments:
        path: the source. out: where packages are unpacked.
        more: endings of files besides `MESH_FILES` that the caller can read.

    Raises ValueError for a source that is none.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if path.suffix == ".sh3f":
        return read_library(path)
    if path.suffix == ".deb":
        if shutil.which("dpkg") is None:
            raise ValueError(f"{path}: unpacking a Debian package needs dpkg; unpack it and name the .sh3f files")
        unpacked = out / "source" / path.stem
        if not unpacked.exists():
            unpacked.parent.mkdir(parents=True, exist_ok=True)
            done = subprocess.run(["dpkg", "-x", str(path), str(unpacked)], capture_output=True, text=True, check=False)
            if done.returncode:
                reason = (done.stderr.strip() or "no reason given").splitlines()[-1]
                raise ValueError(f"{path}: dpkg cannot unpack it ({reason})")
        path = unpacked
    if not path.is_dir():
        raise ValueError(f"{path}: not a .sh3f library, a .deb package or a folder")
    libraries = sorted(path.rglob("*.sh3f"))
    found = [entry for library in libraries for entry in read_library(library)]
    found = found or read_folder(path, (*MESH_FILES, *more))
    if not found:
        raise ValueError(f"{path}: holds neither .sh3f libraries nor {', '.join((*MESH_FILES, *more))} files")
    return found
