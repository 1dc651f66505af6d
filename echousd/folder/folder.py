"""A room's folder on disk: files appear together or not at all, and what is not ours stays untouched (no pxr here).

Everything new is first written to `.echousd/` inside the folder. A journal beside it, itself renamed into place, then
says which files move where; from then on the run can be finished by whoever comes next, before nothing was changed.
"""

import os
import shutil
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from echomodel.files import check_free, check_ours, digest, telling
from echomodel.late import Late
from echousd.folder.journal import DONE, Journal, Move, Removal, digest_of, flush_all, write_journal
from echousd.folder.lock import LOCK, locked, run_of
from echousd.folder.manifest import find_manifest
from echousd.folder.within import inside
from echousd.naming import STAGE_FORMS, free_name
from echousd.pending import JOURNAL, STAGING, half_written
from echousd.stage.files import check_path

read_journal, whole = (Late(f"echousd.folder.interrupted:{name}") for name in ("read_journal", "whole"))


def claim(folder: Path, *, force: bool, root: str = "") -> dict[str, Any]:
    """Make sure that `folder` is ours to write into, finish or discard an interrupted run, and return the old manifest.

    Where several rooms lie in the folder, it is that of the room called `root` if there is one.

    Raises ValueError for a file in the way, or a folder that holds other things than a room of ours.
    """
    check_path(folder)
    recover(folder)
    manifest = find_manifest(folder, root)
    if manifest is not None:
        return manifest
    check_ours(folder, "room of EchoUSD", force=force, besides=(STAGING, LOCK))
    return {}


def check_writable(folder: Path) -> None:
    """Raises ValueError where nothing can be written into `folder`, or where it cannot be created."""
    check_path(folder)
    nearest = next(place for place in (folder, *folder.parents) if place.exists())
    if not nearest.is_dir():
        here = "is a file, the output must be a folder"
        raise ValueError(f"{folder}: {here}" if nearest == folder else f"{folder}: {nearest} is a file, not a folder")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise ValueError(f"{folder}: {nearest} is not writable (permission denied)")


def write_together(
    folder: Path, files: Mapping[str, bytes], *, last: Iterable[str], remove: Iterable[str],
    kept: Mapping[str, str] | None = None,
) -> list[str]:  # fmt: skip
    """Write all files of a room as one step and return the paths that changed.

    Files whose bytes are already there are not touched.

    Arguments:
        folder: created if need be.
        files: relative path (forward slashes) -> content, in the order in which they are moved into place.
        last: those of them that are moved after all others, in this order.
        remove: relative paths that no longer belong to the room, deleted at the very end; where nothing changes, they
            are left.
        kept: files that are not ours -> what each is called from then on; whoever ends the run warns of them.

    Raises:
        ValueError: something cannot be written, would be outside of the folder, or another process is writing there;
            then nothing was changed.
    """
    with held(folder):
        journal = _stage(folder, files, list(last), list(remove), dict(kept or {}))
        if journal.move:
            finish(folder, journal)
    return [entry.to for entry in journal.move]


def _stage(
    folder: Path, files: Mapping[str, bytes], last: list[str], remove: list[str], kept: dict[str, str]
) -> Journal:
    """Write what differs and the journal into the staging folder, and return the journal."""
    staging = folder / STAGING
    order = [path for path in files if path not in last] + [path for path in last if path in files]
    for path in (*order, *remove):
        if inside(folder, path, "a file of the room").is_dir():
            raise ValueError(f"{folder / path}: is a folder, where a file of the room belongs; nothing was changed")
    above = sorted({place for path in order for place in PurePosixPath(path).parents})
    for blocking in (folder / place for place in above if (folder / place).is_file()):
        raise ValueError(f"{blocking}: is a file, where a folder of the room belongs; nothing was changed")
    try:
        _discard(staging)
        staging.mkdir()
        move: list[Move] = []
        for path in order:
            new, old = digest(files[path]), digest_of(folder / path)
            if new != old:
                (staging / str(len(move))).write_bytes(files[path])
                move.append(Move(staged=str(len(move)), to=path, digest=new, over=old))
        gone = [Removal(path=path, digest=digest_of(folder / path)) for path in remove if (folder / path).is_file()]
        journal = Journal(run=run_of(folder), move=move, remove=gone, kept=kept)
        if move:
            write_journal(staging, journal)
        else:
            _discard(staging)
    except OSError as error:
        shutil.rmtree(staging, ignore_errors=True)
        raise ValueError(f"{folder}: cannot be written ({error.strerror or error}); nothing was changed") from None
    return journal


@contextmanager
def held(folder: Path, *, wait: bool = False, run: str = "") -> Iterator[str]:
    """Have the folder for this process alone, and an interrupted run finished first.

    Arguments:
        wait: for another process that writes the folder, instead of raising.
        run: what this one does: a word and what tells it from others. Until the end of the outermost block the folder
            says so, for whoever begins the same once more after this process died.

    Yields the `run` that was finished, "" for none and in a block inside another. Raises ValueError as `recover` does.
    """
    with locked(folder, wait=wait, run=run) as outermost:
        yield recover(folder) if outermost else ""
        if outermost and not half_written(folder):
            _discard(folder / STAGING)


def recover(folder: Path) -> str:
    """Finish an interrupted run that had written its journal, warn, and return its name; discard one that had not.

    Raises ValueError where that is impossible, where another process is writing, and for a journal that names anything
    outside of the folder.
    """
    staging = folder / STAGING
    if not staging.is_symlink() and not staging.is_dir():
        return ""
    with locked(folder) as outermost:
        pending = half_written(folder)
        run = finish(folder)
        if pending and run is not None:
            what = (run or "run").partition(" ")[0]
            warnings.warn(f"{folder}: the {what} that was interrupted is finished now", stacklevel=3)
        if outermost and not half_written(folder):
            _discard(staging)
    return run or ""


def finish(folder: Path, written: Journal | None = None) -> str | None:
    """Do what the journal of a run says, and return the run's name; None where there is nothing to finish.

    `written`: the journal, where this process has just written it and all that it names.
    """
    staging = folder / STAGING
    with telling(folder, then="; run again to finish"):
        journal = written or read_journal(folder)
        if journal is not None and (written or whole(folder, journal)):
            _finish(folder, journal)
            (staging / JOURNAL).replace(staging / DONE)
        else:
            journal = None if journal else read_journal(folder, DONE)
        if journal is None or not journal.run:
            _discard(staging)
        return journal.run if journal else None


def backup_name(folder: Path, path: str) -> str:
    """`layers/layout.edited.usda` for `layers/layout.usda`, or the first free one of `.edited_2`, `.edited_3` ..."""
    place = Path(path)

    def name(word: str) -> str:
        return place.with_name(f"{place.stem}.{word}{place.suffix}").as_posix()

    return name(free_name("edited", lambda word: os.path.lexists(folder / name(word))))


def tell_kept(folder: Path, path: str, kept: str) -> None:
    """Warn that a file that is not ours, or was edited, is now called `kept`."""
    warnings.warn(f"{folder / path}: not as echousd wrote it; kept as {kept}", stacklevel=3)


def _finish(folder: Path, journal: Journal) -> None:
    touched = {folder}
    for entry in journal.move:
        staged, place = folder / STAGING / entry.staged, folder / entry.to
        if not staged.exists():  # an earlier run has moved it
            continue
        place.parent.mkdir(parents=True, exist_ok=True)
        touched |= {place.parent, place.parent.parent}
        if digest_of(place) not in ("", entry.over, entry.digest):  # somebody's, since the run was interrupted
            kept = backup_name(folder, entry.to)
            place.replace(folder / kept)
            tell_kept(folder, entry.to, kept)
        staged.replace(place)
    for removal in journal.remove:
        place = folder / removal.path
        if digest_of(place) == removal.digest:
            place.unlink(missing_ok=True)
        _remove_empty(place.parent, folder)
    for path, name in journal.kept.items():
        tell_kept(folder, path, name)
    flush_all(place for place in touched if place.is_dir())


def _discard(staging: Path) -> None:
    if staging.is_symlink():
        raise ValueError(f"{staging}: is a link, where runs keep their own files; remove it")
    if staging.exists():
        (staging / JOURNAL).unlink(missing_ok=True)  # before what it names
        shutil.rmtree(staging)


def _remove_empty(folder: Path, top: Path) -> None:
    while folder != top and folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
        folder = folder.parent


def check_output(output: Path, *, flat: bool, force: bool) -> None:
    """Refuse before the long work what would be refused after it; raises ValueError."""
    if flat:
        if output.suffix not in (".usda", ".usdc"):
            raise ValueError(f"{output}: with --flat the output is a file that ends in .usda or .usdc")
        check_free(output, force=force)
        return
    if output.suffix in STAGE_FORMS:
        raise ValueError(f"{output}: the output is a folder; --flat writes one file")
    check_writable(output)


@contextmanager
def writing(output: Path, *, flat: bool, force: bool, wait: bool, run: str = "") -> Iterator[bool]:
    """Have the folder for this process alone, from what is read of it to what is written.

    Yields whether the same run was interrupted and has been finished now, see `echousd.folder.folder.held`.
    """
    if flat:
        yield False
        return
    with held(output, wait=wait, run=run) as finished:
        claim(output, force=force)
        yield bool(run) and finished == run
