"""Files that this process may read itself: what a manifest or the key of a store vouches for, and shallow texts."""

from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from echomodel import files
from echomodel.late import Late
from echousd.naming import CRATE
from echousd.pending import DEEP
from echousd.stage.vouched import read_here, stamp_of

NESTED = 4_000  # brackets that a text may open: OpenUSD is at its end where some 10,000 stand within each other
check_apart, stored = Late("echousd.stage.apart:check_apart"), Late("echousd.store:stored")
read_json = Late("echomodel.bounded:read_json")
LARGE = 64 * 2**20  # bytes of a file that is looked at here, before it is read


def check_harmless(path: Path, stage: Path | None = None) -> None:
    """Raises StageError for a file that ends the process that reads it, which another does where this may be.

    Arguments:
        stage: what the other process reads, None = the file.
    """
    if not _harmless(path):
        check_apart(stage or path)


def _harmless(path: Path) -> bool:
    """Whether this process may read a file: it was read apart, or is ours, or a text that cannot be nested deeply."""
    stamp = stamp_of(path)
    if stamp in read_here:
        return True
    if stamp[1] > LARGE:
        return False
    try:
        content = path.read_bytes()
    except OSError:  # told by whoever opens it next
        return True
    packed = content.startswith((CRATE, b"PK"))
    text = not packed and sum(content.count(mark) for mark in (b"{", b"[", b"(")) <= NESTED
    if not (text or as_written(path, content) or stored(path)):
        return False
    read_here.add(stamp)
    return True


def as_written(path: Path, content: bytes) -> bool:
    """Whether the manifest of a room that a file may lie in says that the room was written with its content."""
    digest = files.digest(content)
    for folder in path.resolve().parents[:DEEP]:
        for listing in (place for place in folder.glob("*.json") if place.with_suffix(".usda").is_file()):
            with suppress(OSError, ValueError, TypeError, KeyError, AttributeError):
                if digest in _digests(listing, listing.stat().st_mtime_ns):
                    return True
    return False


@lru_cache(maxsize=16)
def _digests(listing: Path, changed: int) -> frozenset[str]:
    return frozenset(read_json(listing, LARGE)["files"].values())
