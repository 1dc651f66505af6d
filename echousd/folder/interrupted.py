"""What a run that was interrupted left in a folder: its journal, read with doubt, and the files that it had staged."""

import json
import warnings
from pathlib import Path

from pydantic import ValidationError

from echousd.folder.journal import Journal, digest_of
from echousd.folder.manifest import LARGEST
from echousd.folder.within import check_links, inside
from echousd.invalid import validation_message
from echousd.pending import JOURNAL, STAGING


def read_journal(folder: Path, name: str = JOURNAL) -> Journal | None:
    """The journal of an interrupted run in `folder`; None where it had not come so far, or cannot be read any more.

    `name`: `JOURNAL`, or `journal.DONE` for that of a run whose files are in place.
    Raises ValueError for entries that name anything outside of the folder; nothing was changed then.
    """
    path = folder / STAGING / name
    check_links(folder, path, f"{path} is read")
    if not path.is_file():
        return None
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError("it is too large")
        journal = Journal.model_validate(json.loads(path.read_bytes()))
    except ValidationError as error:
        give_up = f"delete {folder / STAGING} to give the interrupted run up"
        raise ValueError(f"{path}: {validation_message(error, Journal)}; {give_up}") from None
    except (ValueError, RecursionError):  # emptied by a power cut, as some disks do
        warnings.warn(f"{path}: cannot be read; the interrupted run is given up, generate the room again", stacklevel=4)
        return None
    named = [(f"{path}: move[{number}]", entry.to) for number, entry in enumerate(journal.move)]
    named += [(f"{path}: remove[{number}]", removal.path) for number, removal in enumerate(journal.remove)]
    for entry, name in named:
        place = inside(folder, name, entry)
        if place.relative_to(folder).parts[0] == STAGING:
            raise ValueError(f"{entry} names {place}, where runs keep their own files; allowed: the room's files")
    for number, move in enumerate(journal.move):
        check_links(folder, folder / STAGING / move.staged, f"{path}: move[{number}] takes {move.staged}")
    return journal


def whole(folder: Path, journal: Journal) -> bool:
    """Whether all that is still staged is what the journal says."""
    for entry in journal.move:
        staged = folder / STAGING / entry.staged
        if staged.exists() and digest_of(staged) != entry.digest:
            warnings.warn(f"{staged}: damaged; the interrupted run is given up, generate the room again", stacklevel=4)
            return False
    return True
