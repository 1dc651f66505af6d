"""A room's folder on disk: files appear together or not at all, and what is not ours stays untouched (no pxr here).

Everything new is first written to `.echousd/` inside the folder. A journal beside it, itself renamed into place, then
says which files move where; from then on the run can be finished by whoever comes next, before nothing was changed.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

STAGING = ".echousd"
JOURNAL = "journal.json"
MANIFEST_KEY = "echousd_room"


def digest(content: bytes) -> str:
    """Short content hash, as the manifest records it."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def find_manifest(folder: Path) -> dict | None:
    """The manifest of the room in `folder`, or None if there is none of ours."""
    for path in sorted(folder.glob("*.json")):
        try:
            raw = json.loads(path.read_text("utf-8"))
        except (OSError, UnicodeDecodeError, json.JSONDecodeError):
            continue
        if isinstance(raw, dict) and MANIFEST_KEY in raw and isinstance(raw.get("files"), dict):
            return raw
    return None


def claim(folder: Path, *, force: bool) -> dict:
    """Make sure that `folder` is ours to write into, finish or discard an interrupted run, and return the old manifest.

    Raises ValueError for a file in the way, or a folder that holds other things than a room of ours.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: is a file, the output must be a folder")
    if not folder.exists():
        return {}
    recover(folder)
    manifest = find_manifest(folder)
    if manifest is not None:
        return manifest
    others = sorted(entry.name for entry in folder.iterdir() if entry.name != STAGING)
    if others and not force:
        shown = ", ".join(others[:3]) + (" ..." if len(others) > 3 else "")
        raise ValueError(f"{folder}: holds {shown} and no room of EchoUSD; choose another folder or use --force")
    return {}


def check_writable(folder: Path) -> None:
    """Raises ValueError where nothing can be written into `folder`, or where it cannot be created."""
    nearest = folder
    while not nearest.exists():
        nearest = nearest.parent
    if not nearest.is_dir():
        raise ValueError(f"{folder}: {nearest} is a file, not a folder")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise ValueError(f"{folder}: {nearest} is not writable (permission denied)")


def write_together(
    folder: Path, files: Mapping[str, bytes], *, last: Iterable[str], remove: Iterable[str]
) -> list[str]:
    """Write all files of a room as one step and return the paths that changed.

    Files whose bytes are already there are not touched.

    Arguments:
        folder: created if need be.
        files: relative path (forward slashes) -> content, in the order in which they are moved into place.
        last: those of them that are moved after all others, in this order.
        remove: relative paths that no longer belong to the room, deleted at the very end.

    Raises:
        ValueError: something cannot be written; then nothing was changed.
    """
    created = not folder.exists()
    staging = folder / STAGING
    last = list(last)
    order = [path for path in files if path not in last] + [path for path in last if path in files]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(staging, ignore_errors=True)
        staging.mkdir()
        changed = [path for path in order if not _holds(folder / path, files[path])]
        for number, path in enumerate(changed):
            (staging / str(number)).write_bytes(files[path])
        gone = [path for path in remove if (folder / path).is_file()]
        journal = {"move": [[str(number), path] for number, path in enumerate(changed)], "remove": gone}
        (staging / "journal.new").write_text(json.dumps(journal), "utf-8")
        (staging / "journal.new").replace(staging / JOURNAL)
    except OSError as error:
        shutil.rmtree(folder if created else staging, ignore_errors=True)
        raise ValueError(f"{folder}: cannot be written ({error.strerror or error}); nothing was changed") from None
    recover(folder)
    return changed


def recover(folder: Path) -> None:
    """Finish an interrupted run that had written its journal; discard one that had not."""
    staging = folder / STAGING
    if not staging.is_dir():
        return
    try:
        if (staging / JOURNAL).is_file():
            journal = json.loads((staging / JOURNAL).read_text("utf-8"))
            for source, path in journal["move"]:
                if (staging / source).exists():  # else an earlier run has moved it
                    (folder / path).parent.mkdir(parents=True, exist_ok=True)
                    (staging / source).replace(folder / path)
            for path in journal["remove"]:
                (folder / path).unlink(missing_ok=True)
                _remove_empty((folder / path).parent, folder)
        shutil.rmtree(staging)
    except OSError as error:
        raise ValueError(f"{folder}: cannot be written ({error.strerror or error}); run again to finish") from None


def _remove_empty(folder: Path, top: Path) -> None:
    while folder != top and folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


def _holds(path: Path, content: bytes) -> bool:
    try:
        return path.stat().st_size == len(content) and path.read_bytes() == content
    except OSError:
        return False
