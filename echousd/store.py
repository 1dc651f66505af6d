"""A store of assets: every folder lies once, named by the hash of what it holds, and rooms refer to it (no pxr here).

    STORE/echousd_store.json    the mark
    STORE/3f/3fa9.../bed.usda   an asset's files, read-only: many rooms use them

Whoever names a file in a store knows the hash of its content; that is why packing and check let a room reach in.
"""

import hashlib
import lzma
import os
import re
import shutil
import tempfile
import time
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

from echomodel.bounded import read_json
from echomodel.files import check_ours, flush, telling, write_json
from echousd.naming import CRATE
from echousd.pending import STAGING

MARK = "echousd_store.json"
VERSION = 1
KEY = re.compile(r"[0-9a-f]{32}")
KEY_IN_PATH = re.compile(r"[\\/][0-9a-f]{32}[\\/]")
NEW = ".new_"  # beginning of the name of a folder that is being written
GRACE = 3600.0  # seconds for which a folder that nobody refers to stays: its room may be on its way
NAMING = (".usda", ".json", ".mtlx", ".yaml", ".yml")  # texts in which a key can be read as it is
LAYERS = (".usd", ".usdc")
ARCHIVES = (".zip", ".usdz")
LARGEST = 4 * 2**30  # bytes of one folder, and of what is unpacked from one file
BLOCK = 2**20
NESTED = 8  # archives within each other: an edit taken back holds that of the edit, with usdz in it


@dataclass(frozen=True)
class Store:
    """A store on disk."""

    root: Path  # its folder

    @classmethod
    def create(cls, root: str | os.PathLike[str]) -> "Store":
        """The store in a folder, made if it is not there; raises ValueError for a folder that holds other things."""
        root = Path(root)
        if root.exists() and not root.is_dir():
            raise ValueError(f"{root}: is a file, a store must be a folder")
        check_ours(root, "store", MARK)  # which another process may have begun just now
        if (root / MARK).is_file():
            return cls.open(root)
        with telling(root):
            root.mkdir(parents=True, exist_ok=True)
            write_json(root / MARK, {"echousd_store": VERSION})
        return cls(root)

    @classmethod
    def open(cls, root: str | os.PathLike[str]) -> "Store":
        """The store in a folder; raises ValueError where there is none, or one of another version."""
        root = Path(root)
        try:
            mark = read_json(root / MARK, 2**16)
        except OSError:
            raise ValueError(f"{root}: no store of assets there (no {MARK})") from None
        if not isinstance(mark, dict) or mark.get("echousd_store") != VERSION:
            raise ValueError(f"{root / MARK}: not a store of this version ({VERSION})")
        return cls(root)

    def folder(self, key: str) -> Path:
        """Where the files of a key lie; raises ValueError where a link would lead out of the store."""
        shelf = self.root / key[:2]
        if shelf.is_symlink():
            raise ValueError(f"{shelf}: a link, allowed in a store: folders")
        return shelf / key

    def put(self, files: Mapping[str, bytes]) -> str:
        """Have a folder with these files (relative path -> content) in the store; returns its key.

        The folder appears whole. One that is there already is left alone, but for one whose files were cut short.

        Raises ValueError for a path that leads out of the folder, or where nothing can be written.
        """
        key = key_of(files)
        place = self.folder(key)
        with telling(place):
            if _whole(place, files):
                os.utime(place)  # it is wanted again: `collect` waits
            else:
                self._write(place, files)
        return key

    def read(self, key: str) -> dict[str, bytes]:
        """The files of a key; raises ValueError where they are missing or not what the key says."""
        place = self.folder(key)
        if not KEY.fullmatch(key) or not place.is_dir():
            raise ValueError(f"{self.root}: {key!r:.40} is not in the store")
        with telling(place, "cannot be read"):
            files = {path.relative_to(place).as_posix(): path.read_bytes() for path in _files(place)}
        if key_of(files) != key:
            raise ValueError(f"{place}: changed since it was stored; make its room again")
        return files

    def whole(self, key: str) -> bool:
        """Whether the files of a key are what it says; none is held in memory."""
        place = self.folder(key)
        try:
            digests = {path.relative_to(place).as_posix(): _digest(path) for path in _files(place)}
            return place.is_dir() and _key(digests) == key
        except (OSError, ValueError):
            return False

    def keys(self) -> Iterator[str]:
        """All keys, sorted."""
        for shelf in sorted(self.root.iterdir()):
            if len(shelf.name) == 2 and shelf.is_dir():
                self.folder(shelf.name)  # no link
                yield from sorted(path.name for path in shelf.iterdir() if KEY.fullmatch(path.name))

    def wrong(self) -> Iterator[str]:
        """Keys whose files are no longer what the key says."""
        yield from (key for key in self.keys() if not self.whole(key))

    def remove(self, key: str) -> None:
        """Take a folder away."""
        place = self.folder(key)
        aside = self._aside(key)
        place.replace(aside)  # gone at once, whatever happens then
        _delete(aside)

    def collect(self, users: Iterable[Path], *, grace: float = GRACE, dry: bool = False) -> list[str]:
        """Remove what no file of a room below `users` names, and return the keys.

        Arguments:
            users: folders with rooms; all that may name a key below them is asked, see `keys_named`.
            grace: seconds since it was last put for which a folder stays in any case.
            dry: remove nothing.
        """
        used, now = keys_named(users), time.time()
        gone = [key for key in self.keys() if key not in used and now - self.folder(key).lstat().st_mtime >= grace]
        for key in () if dry else gone:
            self.remove(key)
        for left in () if dry else self.root.glob(f"{NEW}*"):  # of a run that was killed
            if now - left.lstat().st_mtime >= grace:
                _delete(left)
        return gone

    def _write(self, place: Path, files: Mapping[str, bytes]) -> None:
        beside = self._aside(place.name)
        try:
            for name, content in files.items():
                path = beside / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
                flush(path)
                path.chmod(0o444)  # an edit of one would change many rooms
            place.parent.mkdir(exist_ok=True)
            if place.is_dir() and not _whole(place, files):
                place.replace(self._aside(f"damaged_{place.name}"))
            beside.rename(place)
            flush(place.parent)
        except OSError:
            if not _whole(place, files):  # else another process was faster
                raise
        finally:
            if beside.is_dir():
                _delete(beside)

    def _aside(self, word: str) -> Path:
        return self.root / f"{NEW}{word}_{os.getpid()}_{time.monotonic_ns()}"


def key_of(files: Mapping[str, bytes]) -> str:
    """Hash of some files, their relative paths and their bytes; raises ValueError for a path that leads elsewhere."""
    return _key({name: hashlib.blake2b(content, digest_size=16).hexdigest() for name, content in files.items()})


def _key(digests: Mapping[str, str]) -> str:
    """The hash of relative paths and the hashes of what is there."""
    total = hashlib.blake2b(digest_size=16)
    for name, digest in sorted(digests.items()):
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or path.as_posix() != name or "\\" in name or ":" in name:
            raise ValueError(f"store: a file is called {name!r:.200}, allowed: a relative path with forward slashes")
        total.update(f"{name}\0{digest}\n".encode())
    return total.hexdigest()


def store_of(path: Path) -> Store | None:
    """The store that a file lies in under a key, its links followed; None for any other file."""
    return store_above(path.resolve())


def store_above(real: Path) -> Store | None:
    """`store_of` for a path without links."""
    if not KEY_IN_PATH.search(str(real)):
        return None
    for place in real.parents:
        if KEY.fullmatch(place.name) and place.parent.name == place.name[:2]:
            root = place.parent.parent
            return Store(root) if (root / MARK).is_file() else None
    return None


def stored(path: Path) -> bool:
    """Whether a store holds a file under the key of what it is."""
    store = store_of(path)
    with suppress(ValueError):
        return store is not None and any(KEY.fullmatch(name) and store.whole(name) for name in path.resolve().parts)
    return False


def keys_named(folders: Iterable[Path]) -> set[str]:
    """All words in the layers and manifests below some folders that may be keys, links to further folders followed.

    Archives of what edits replaced are asked as well, and what an interrupted run has not moved into place yet.

    Raises OSError for a folder or file that cannot be read, ValueError for archives within archives that go too deep
    or hold too much, as they might name any.
    """
    found: set[str] = set()
    for path in (path for folder in folders for path in _all_files(folder)):
        if path.suffix not in (*NAMING, *LAYERS, *ARCHIVES) and path.parent.name != STAGING:
            continue
        if path.is_file() and store_of(path) is None:
            with suppress(FileNotFoundError), path.open("rb") as file:  # gone meanwhile
                found.update(_keys_in(file, _Asked(path)))
    return found


def _all_files(folder: Path) -> Iterator[Path]:
    """All files below a folder, in order; of one that several links lead to, once."""

    def fail(error: OSError) -> None:
        if not isinstance(error, FileNotFoundError):  # gone meanwhile
            raise error

    seen = {os.path.realpath(folder)}
    for place, folders, names in os.walk(folder, onerror=fail, followlinks=True):
        real = {name: os.path.realpath(Path(place, name)) for name in sorted(folders)}
        folders[:] = [name for name, path in real.items() if path not in seen]
        seen.update(real.values())
        yield from (Path(place, name) for name in sorted(names))


@dataclass
class _Asked:
    """A file whose words are asked for, and how many bytes were unpacked from it and from archives within."""

    path: Path
    unpacked: int = 0

    def copy(self, source: IO[bytes], target: IO[bytes]) -> None:
        """Have what can be read only forwards as a file; raises ValueError where all of it is more than `LARGEST`."""
        while block := source.read(BLOCK):
            self.unpacked += len(block)
            if self.unpacked > LARGEST:
                raise self.refusal(f"unpacks to more than {LARGEST} bytes")
            target.write(block)
        target.seek(0)

    def refusal(self, found: str) -> ValueError:
        return ValueError(f"{self.path}: {found}, which may name any asset; move it away")


def _keys_in(file: IO[bytes], asked: _Asked, depth: int = 0) -> Iterator[str]:
    """Words of a layer, manifest or archive that may be keys, `depth` archives deep; what it is its first bytes say."""
    head = file.read(8)
    file.seek(0)
    if head.startswith(b"PK"):
        yield from _keys_in_archive(file, asked, depth + 1)
    elif head == CRATE:
        yield from (word for name in _named_by(file, None if depth else asked.path) for word in KEY.findall(name))
    else:
        yield from _words_in(file)


def _keys_in_archive(file: IO[bytes], asked: _Asked, depth: int) -> Iterator[str]:
    if depth > NESTED:
        raise asked.refusal(f"archives within archives, more than {NESTED} deep")
    try:
        with zipfile.ZipFile(file) as archive:
            for entry in archive.infolist():
                if PurePosixPath(entry.filename).suffix in (*NAMING, *LAYERS, *ARCHIVES):
                    with archive.open(entry) as inner, tempfile.SpooledTemporaryFile(BLOCK) as whole:
                        asked.copy(inner, whole)
                        yield from _keys_in(whole, asked, depth)
    except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, RuntimeError, EOFError, UnicodeDecodeError):
        return  # nothing can be put back from it
    except OSError as error:  # of the disk, too
        raise asked.refusal(f"cannot be read ({error.strerror or error})") from None


def _words_in(file: IO[bytes]) -> Iterator[str]:
    """Words of a text that may be keys, block by block."""
    rest = b""
    while block := file.read(BLOCK):
        rest += block
        yield from (word.decode() for word in re.findall(rb"(?<![0-9a-f])[0-9a-f]{32}", rest))
        rest = rest[-40:]  # a word across two blocks, and what stands before it


def _named_by(file: IO[bytes], path: Path | None) -> list[str]:
    """What a binary layer refers to; one without a name of its own is asked under another."""
    with ExitStack() as held:
        if path is None or path.suffix not in LAYERS:
            copy = held.enter_context(tempfile.NamedTemporaryFile(suffix=".usdc"))
            shutil.copyfileobj(file, copy)
            copy.flush()
            path = Path(copy.name)
        return references_of(path)


def references_of(layer: Path) -> list[str]:
    """What a layer refers to, by the names that it says; empty for a file that is none."""
    from pxr import Tf, UsdUtils

    try:
        return [name for names in UsdUtils.ExtractExternalReferences(str(layer)) for name in names]
    except Tf.ErrorException:
        return []


def _whole(place: Path, files: Mapping[str, bytes]) -> bool:
    """Whether a folder holds files of these names and lengths; what they hold is for `wrong` to say."""
    if not place.is_dir():
        return False
    return {p.relative_to(place).as_posix(): p.lstat().st_size for p in _files(place)} == {
        name: len(content) for name, content in files.items()
    }


def _files(place: Path) -> list[Path]:
    """All files of a folder; raises ValueError for a link, which never belongs there, and for more than `LARGEST`."""
    if place.is_symlink():
        raise ValueError(f"{place}: a link, allowed in a store: folders")
    found = [path for path in place.rglob("*") if path.is_symlink() or not path.is_dir()]
    for path in found:
        if path.is_symlink() or not path.is_file():
            raise ValueError(f"{path}: a link or no plain file, allowed in a store: plain files")
    size = sum(path.stat().st_size for path in found)
    if size > LARGEST:
        raise ValueError(f"{place}: {size} bytes, allowed in a store: folders of {LARGEST}")
    return found


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()


def _delete(place: Path) -> None:
    if place.is_symlink() or not place.is_dir():  # whatever a link leads to is not ours
        place.unlink(missing_ok=True)
        return
    for path in place.rglob("*") if os.name == "nt" else ():  # it deletes nothing that is read-only
        if not path.is_dir() and not path.is_symlink():
            path.chmod(0o644)
    shutil.rmtree(place, ignore_errors=True)
