"""What a room was before each edit: the files that the edit replaced, archived; steps back and forth (no pxr here)."""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from echousd.room import folder as folders
from echousd.room import ownership
from echousd.room.lock import locked
from echousd.room.manifest import find_manifest, read_manifest
from echousd.room.within import inside

FOLDER = "history"
UNDONE = ".redo"  # folder of what was taken back, until something else is written
TOLD = ".redo"  # entry of such an archive: which state it follows, what was edited, which files the edit removes
LONGEST = 50  # steps that are kept
LARGEST = 2**30  # bytes of one state that are read back
WHEN = (1980, 1, 1, 0, 0, 0)  # of every file in an archive: equal states are equal bytes


def remembered(
    folder: Path, old: Mapping[str, Any], files: Mapping[str, bytes], steps: Sequence[str]
) -> tuple[list[dict[str, Any]], dict[str, bytes]]:
    """The history of a room after an edit, and the archive of what the edit replaces: path -> bytes.

    Arguments:
        folder: the room's, as it is before the edit.
        old: its manifest. files: what the edit writes, without the manifest. steps: what the edit says.
    """
    manifest = f"{old['name']}.json"
    before = {path: ownership.read(folder, path) for path in old["files"] if not path.startswith(f"{FOLDER}/")}
    ours = {p: c for p, c in before.items() if c is not None and folders.digest(c) == old["files"][p]}
    replaced = {path: content for path, content in ours.items() if files.get(path) != content}
    told = ownership.read(folder, manifest)
    if told is None or not (replaced or steps):
        return list(old["history"]), {}
    number = 1 + max((entry["number"] for entry in old["history"]), default=0)
    where = f"{FOLDER}/{number}.zip"
    added = sorted(path for path in files if path not in old["files"])
    entry = {"number": number, "steps": list(steps), "restores": where, "adds": added}
    return [*old["history"], entry][-LONGEST:], {where: _archive({**replaced, manifest: told})}


def undo(root: Path, *, wait: bool = False) -> tuple[str, ...]:
    """Put a room back to what it was before its last edit, byte for byte, and say which steps were taken back.

    Arguments:
        root: the room's root layer. wait: for another process that writes the folder.

    Raises ValueError where there is no edit to take back, a file of the room was changed by somebody since, or the
    archive is damaged; nothing is changed then.
    """
    folder = root.parent
    with locked(folder, wait=wait):
        manifest = folders.claim(folder, force=False, root=root.stem)
        if not manifest.get("history"):
            raise ValueError(f"{root}: no edit to take back")
        last = manifest["history"][-1]
        files = _read_archive(folder, last["restores"])
        name = f"{manifest['name']}.json"
        if name not in files:
            raise ValueError(f"{folder / last['restores']}: holds no manifest {name}")
        earlier = read_manifest(folder / name, json.loads(files[name]))
        _check_untouched(folder, manifest, (*files, *last["adds"]), "take the edit back")
        for path in files:
            if path != name and path not in earlier["files"]:
                raise ValueError(f"{folder / last['restores']}: holds {path!r}, which is no file of the room")
        gone = [path for path in (*last["adds"], last["restores"]) if path in manifest["files"] and path not in files]
        taken = {path: ownership.read(folder, path) for path in (*files, *gone) if path in (*manifest["files"], name)}
        told = {"after": folders.digest(files[name]), "steps": last["steps"],
                "removes": [path for path in files if path not in taken]}  # fmt: skip
        again = {path: content for path, content in taken.items() if content is not None}
        undone = {f"{UNDONE}/{last['number']}.zip": _archive({**again, TOLD: json.dumps(told).encode()})}
        order = [f"{manifest['name']}.usda", name]
        folders.write_together(folder, {**undone, **files}, last=order, remove=gone)
    assert find_manifest(folder, root.stem) is not None
    return tuple(last["steps"])


def redo(root: Path, *, wait: bool = False) -> tuple[str, ...]:
    """Make the edit that was taken back last once more, byte for byte, and say which steps it were.

    Arguments:
        root: the room's root layer. wait: for another process that writes the folder.

    Raises ValueError where none was taken back or the room is another since, a file of the room was changed by
    somebody, or the archive is damaged; nothing is changed then.
    """
    folder = root.parent
    with locked(folder, wait=wait):
        manifest = folders.claim(folder, force=False, root=root.stem)
        name = f"{manifest.get('name', root.stem)}.json"
        now = ownership.read(folder, name) if manifest else None
        archive = None if now is None else _following(folder, folders.digest(now))
        if archive is None:
            raise ValueError(f"{root}: no edit that was taken back can be made again")
        files = _read_archive(folder, archive)
        told = _read_told(folder / archive, files.pop(TOLD, b""))
        _check_untouched(folder, manifest, (*files, *told.removes), "make the edit again")
        later = read_manifest(folder / name, json.loads(files.get(name, b"{}")))
        strange = [path for path in files if path != name and path not in later["files"]]
        strange += [path for path in told.removes if path not in manifest["files"]]
        if strange:
            raise ValueError(f"{folder / archive}: names {strange[0]!r}, which is no file of the room")
        order = [f"{manifest['name']}.usda", name]
        folders.write_together(folder, files, last=order, remove=[*told.removes, archive])
    return tuple(told.steps)


def undone(folder: Path) -> list[str]:
    """Paths of the archives of edits that were taken back, the earliest edit first."""
    found = [path for path in inside(folder, UNDONE, "a file of the room").glob("*.zip") if path.stem.isdecimal()]
    return [f"{UNDONE}/{path.name}" for path in sorted(found, key=lambda path: int(path.stem))]


def _following(folder: Path, state: str) -> str | None:
    """Path of the archive of the edit that follows a state of the room (digest of its manifest), None for none.

    Raises ValueError where none does and an archive is damaged, so that it might have been that one.
    """
    damaged: ValueError | None = None
    for archive in undone(folder):
        try:
            told = _read_told(folder / archive, _read_archive(folder, archive, only=TOLD).get(TOLD, b""))
        except ValueError as error:
            damaged = damaged or error
            continue
        if told.after == state:
            return archive
    if damaged is not None:
        raise damaged
    return None


class _Told(BaseModel):
    """What an archive of an edit that was taken back says of it."""

    model_config = ConfigDict(strict=True, extra="forbid")

    after: str
    steps: list[str]
    removes: list[str]


def _read_told(archive: Path, content: bytes) -> _Told:
    try:
        return _Told.model_validate_json(content)
    except ValidationError:
        raise ValueError(f"{archive}: is damaged (it does not say which edit it holds)") from None


def _check_untouched(folder: Path, manifest: Mapping[str, Any], paths: Iterable[str], then: str) -> None:
    """Raises ValueError for a file of the room that somebody changed."""
    for path in [path for path in paths if path in manifest["files"]]:
        content = ownership.read(folder, path)
        if content is not None and folders.digest(content) != manifest["files"][path]:
            raise ValueError(f"{folder / path}: was changed since; move it away first, then {then}")


def _archive(files: Mapping[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(files):
            info = zipfile.ZipInfo(path, WHEN)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, files[path])
    return out.getvalue()


def _read_archive(folder: Path, path: str, *, only: str = "") -> dict[str, bytes]:
    """Entries of an archive by name, all or one alone; raises ValueError where it is damaged."""
    content = ownership.read(folder, path)
    if content is None:
        raise ValueError(f"{folder / path}: is missing, so that the room cannot be put back")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
                raise zipfile.BadZipFile(f"more than {LARGEST >> 20} MiB")
            return {e.filename: archive.read(e) for e in archive.infolist() if only in ("", e.filename)}
    except (zipfile.BadZipFile, zlib.error, RuntimeError, EOFError, OSError, ValueError) as error:
        raise ValueError(f"{folder / path}: is damaged ({error})") from None
