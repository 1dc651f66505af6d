"""What a room was before each edit: the files that the edit replaced, archived; steps back and forth (no pxr here)."""

import io
import json
import os
import zipfile
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from echomodel.bounded import unpacking
from echomodel.files import within_memory
from echousd.folder import folder as folders
from echousd.folder import ownership
from echousd.folder.manifest import find_manifest, read_manifest
from echousd.folder.within import inside

FOLDER = "history"
UNDONE = ".redo"  # folder of what was taken back, until something else is written
NOTE = ".redo"  # entry of such an archive: which state it follows, what was edited, which files the edit removes
LONGEST = 50  # steps that are kept
LARGEST = 2**30  # bytes of one state that are read back
WHEN = (1980, 1, 1, 0, 0, 0)  # of every file in an archive: equal states are equal bytes


def remembered(
    folder: Path, old: Mapping[str, Any], files: Mapping[str, bytes], owned: Mapping[str, str],
    copies: Collection[str], steps: Sequence[str],
) -> tuple[list[dict[str, Any]], dict[str, bytes]]:  # fmt: skip
    """The history of a room after an edit, and the archive of what the edit replaces: path -> bytes.

    Arguments:
        folder: the room's, as it is before the edit.
        old: its manifest. files: what the edit writes, without the manifest. steps: what the edit says.
        owned: digests of what is ours from then on. copies: those that only keep somebody's bytes.
    """
    manifest = f"{old['name']}.json"
    known = [path for path in old["files"] if not path.startswith(f"{FOLDER}/")]
    before = {path: ownership.read(folder, path) for path in dict.fromkeys((*known, *files)) if path not in copies}
    replaced = {
        path: content
        for path, content in before.items()
        if content is not None
        and files.get(path) != content
        and (path in files or (path not in owned and folders.digest(content) == old["files"][path]))
    }
    saved = ownership.read(folder, manifest)
    if saved is None or not (replaced or steps):
        return list(old["history"]), {}
    number = 1 + max((entry["number"] for entry in old["history"]), default=0)
    number, where = _free(folder, FOLDER, number)
    leaves = {path: folders.digest(files[path]) for path in before if path in files and before[path] != files[path]}
    entry = {
        "number": number,
        "steps": list(steps),
        "restores": where,
        "adds": sorted(path for path in leaves if before[path] is None),
        "leaves": {path: digest for path, digest in sorted(leaves.items()) if owned.get(path) != digest},
    }
    return [*old["history"], entry][-LONGEST:], {where: _archive({**replaced, manifest: saved})}


def undo(root: Path) -> tuple[str, ...]:
    """Put a room (root layer) back to what it was before its last edit, byte for byte; returns the steps taken back.

    Raises ValueError where there is no edit to take back, somebody changed a file of the room or put another in its
    place, or the archive is damaged; nothing is changed then.
    """
    folder = root.parent
    with folders.held(folder, run="undo") as finished:
        if finished == "undo":
            return steps_of(root, "undo")
        manifest = folders.claim(folder, force=False, root=root.stem)
        if not manifest.get("history"):
            raise ValueError(f"{root}: no edit to take back")
        last = manifest["history"][-1]
        files = _read_archive(folder, last["restores"], digest=manifest["files"].get(last["restores"], ""))
        name = f"{manifest['name']}.json"
        if name not in files:
            raise ValueError(f"{folder / last['restores']}: holds no manifest {name}")
        earlier = read_manifest(folder / name, json.loads(files[name]))
        expected = {**manifest["files"], **last["leaves"]}
        gone = [path for path in (*last["adds"], last["restores"]) if path in expected and path not in files]
        digests = {path: folders.digest(content) for path, content in files.items()}
        words = _Note(
            after=digests[name],
            steps=last["steps"],
            removes=[path for path in files if path not in expected and ownership.read(folder, path) is None],
            leaves={p: d for p, d in digests.items() if p != name and earlier["files"].get(p) != d},
        )
        again = _step(folder, last["restores"], files, gone, expected, earlier, "take the edit back")
        _, where = _free(folder, UNDONE, last["number"])
        order = [f"{manifest['name']}.usda", name]
        undone = {where: _archive({**again, NOTE: words.model_dump_json().encode()})}
        drawn = ownership.pictures(folder, manifest["name"])
        folders.write_together(folder, {**undone, **files}, last=order, remove=[*gone, *drawn])
    return tuple(last["steps"])


def redo(root: Path) -> tuple[str, ...]:
    """Make once more the edit of a room (root layer) that was taken back last, byte for byte; returns its steps.

    Raises ValueError where none was taken back or the room is another since, somebody changed a file of the room or
    put another in its place, or the archive is damaged; nothing is changed then.
    """
    folder = root.parent
    with folders.held(folder, run="redo") as finished:
        if finished == "redo":
            return steps_of(root, "redo")
        manifest = folders.claim(folder, force=False, root=root.stem)
        name = f"{manifest.get('name', root.stem)}.json"
        now = ownership.read(folder, name) if manifest else None
        archive = None if now is None else _following(folder, folders.digest(now))
        if archive is None:
            raise ValueError(f"{root}: no edit that was taken back can be made again")
        files = _read_archive(folder, archive)
        words = _read_note(folder / archive, files.pop(NOTE, b""))
        later = read_manifest(folder / name, json.loads(files.get(name, b"{}")))
        expected = {**manifest["files"], **words.leaves}
        _step(folder, archive, files, words.removes, expected, later, "make the edit again")
        order, drawn = [f"{manifest['name']}.usda", name], ownership.pictures(folder, manifest["name"])
        folders.write_together(folder, files, last=order, remove=[*words.removes, archive, *drawn])
    return tuple(words.steps)


def steps_of(root: Path, run: str) -> tuple[str, ...]:
    """What the last `undo` of a room took back, or else its last edit or `redo` did; empty where nothing says so."""
    manifest = find_manifest(root.parent, root.stem)
    now = ownership.read(root.parent, f"{manifest['name']}.json") if manifest else None
    if run != "undo" or now is None:
        return tuple(manifest["history"][-1]["steps"]) if manifest and manifest["history"] else ()
    archive = _following(root.parent, folders.digest(now))
    return tuple(_read_note(Path(archive), _read_archive(root.parent, archive)[NOTE]).steps) if archive else ()


def undone(folder: Path) -> list[str]:
    """Paths of the archives of edits that were taken back, the earliest edit first; what others put there is none."""
    return [archive for archive, note in _numbered(folder) if isinstance(note, _Note)]


def _numbered(folder: Path) -> "Iterator[tuple[str, _Note | ValueError]]":
    """Paths of the archives of edits that were taken back, by number, and what each says, or what is wrong with it."""
    found = [path for path in inside(folder, UNDONE, "a file of the room").glob("*.zip") if path.stem.isdecimal()]
    for archive in (f"{UNDONE}/{path.name}" for path in sorted(found, key=lambda path: int(path.stem))):
        try:
            yield archive, _read_note(folder / archive, _read_archive(folder, archive, only=NOTE).get(NOTE, b""))
        except ValueError as error:
            yield archive, error


def _free(folder: Path, where: str, number: int) -> tuple[int, str]:
    """The first number from one on, and the path of its archive, that nobody's file in the room's folder has."""
    while os.path.lexists(folder / where / f"{number}.zip"):
        number += 1
    return number, f"{where}/{number}.zip"


def _following(folder: Path, state: str) -> str | None:
    """Path of the archive of the edit that follows a state of the room (digest of its manifest), None for none.

    Raises ValueError where none does and an archive is damaged, so that it might have been that one.
    """
    found = list(_numbered(folder))
    for archive, note in found:
        if isinstance(note, _Note) and note.after == state:
            return archive
    for _, note in found:
        if isinstance(note, ValueError):
            raise note
    return None


def _step(
    folder: Path, archive: str, files: Mapping[str, bytes], removes: Sequence[str], expected: Mapping[str, str],
    to: Mapping[str, Any], then: str,
) -> dict[str, bytes]:  # fmt: skip
    """Make sure that a step costs nobody a byte, and return all that it replaces and removes: path -> content.

    Arguments:
        files, removes: what it does. archive: where that stands. to: manifest of the state that it leads to.
        expected: digests of what the last step left.
        then: what shall be done once the folder is as it was.

    Raises ValueError for a file of the room that somebody changed, for another in its place, and for assets that the
    state needs and its store no longer has.
    """
    name = f"{to['name']}.json"
    known = {*expected, *to["files"], *(to["history"][-1]["leaves"] if to["history"] else ())}
    strange = [path for path in files if path != name and path not in known]
    strange += [path for path in removes if path not in expected]
    if strange:
        raise ValueError(f"{folder / archive}: names {strange[0]!r}, which is no file of the room")
    found: dict[str, bytes] = {}
    for path in (*files, *removes):
        place, content = folder / path, ownership.read(folder, path)
        fresh = content is None or content == files.get(path) or path == name
        if place.is_symlink() or not (fresh or path in expected):
            raise ValueError(f"{place}: is not the room's; move it away first, then {then}")
        if content is not None and not fresh and folders.digest(content) != expected[path]:
            raise ValueError(f"{place}: was changed since; move it away first, then {then}")
        found |= {} if content is None else {path: content}
    from echousd.folder.stored import shelf_of

    shelf = shelf_of(to, folder)
    if shelf is not None:
        gone = [unit for unit, key in shelf.keys.items() if not shelf.store.folder(key).is_dir()]
        if gone:
            lost = f"{gone[0]} ({shelf.keys[gone[0]]})"
            raise ValueError(f"{folder}: {lost} is not in the store {shelf.store.root}; nothing was changed")
    return found


class _Note(BaseModel, strict=True, extra="forbid"):
    """What an archive of an edit that was taken back says of it."""

    after: str
    steps: list[str]
    removes: list[str]
    leaves: dict[str, str] = {}


def _read_note(archive: Path, content: bytes) -> _Note:
    try:
        return _Note.model_validate_json(content)
    except ValidationError:
        raise ValueError(f"{archive}: is damaged (it does not say which edit it holds)") from None


def _archive(files: Mapping[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(files):
            info = zipfile.ZipInfo(path, WHEN)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, files[path])
    return out.getvalue()


def _read_archive(folder: Path, path: str, *, only: str = "", digest: str = "") -> dict[str, bytes]:
    """Entries of an archive by name, all or one alone; raises ValueError where it is damaged or has not the digest."""
    content = ownership.read(folder, path)
    if content is None:
        raise ValueError(f"{folder / path}: is missing, so that the room cannot be put back")
    if digest and folders.digest(content) != digest:
        raise ValueError(f"{folder / path}: was changed since it was written, so that the room cannot be put back")
    place = folder / path
    with unpacking(place), within_memory(place), zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > LARGEST:
            raise ValueError(f"{place}: is damaged (more than {LARGEST >> 20} MiB)")
        return {e.filename: archive.read(e) for e in archive.infolist() if only in ("", e.filename)}
