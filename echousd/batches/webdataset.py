"""WebDataset tars of a run: preview and JSON of every room, in the order of the plan; equal rooms give equal tars."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from echomodel.files import read_bounded, read_json, whole_file
from echousd.folder.manifest import LARGEST
from echousd.folder.within import inside
from echousd.textures import MAX_BYTES

FOLDER = "webdataset"
ROOMS = 1000  # in one tar


def write_webdataset(folder: Path, rows: Iterable[dict[str, Any]], rooms: int = ROOMS) -> list[Path]:
    """Write `webdataset/rooms-000000.tar` and so on; `<id>.png` is left out of rooms that have no preview.

    `<id>.json` holds the room's row of the manifest and, as `room`, what lies beside the room: its graph, verdicts,
    assets and seed.

    Arguments:
        folder: of the run. rows: of its manifest; rooms that are not done are left out. rooms: in one tar.
    """
    place = inside(folder, FOLDER, f"{folder}: the run")
    place.mkdir(exist_ok=True)
    written: list[Path] = []
    done = (row for row in rows if row["state"] == "done")
    while pack := [row for _, row in zip(range(rooms), done)]:  # noqa: B905  # the last one is shorter
        path = place / f"rooms-{len(written):06d}.tar"
        with whole_file(path) as beside, tarfile.open(beside, "w", format=tarfile.USTAR_FORMAT) as tar:
            for row in pack:
                for name, content in _members(folder, row):
                    _add(tar, name, content)
        written.append(path)
    for left in set(place.glob("rooms-*.tar")) - set(written):  # of a run that had more
        left.unlink()
    return written


def _members(folder: Path, row: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
    told = {key: value for key, value in row.items() if key != "seconds"}  # the only thing that no seed decides
    beside, picture = (
        inside(folder, str(PurePosixPath(row["root"]).with_suffix(ending)), f"{folder}: the manifest")
        for ending in (".json", ".png")
    )
    told["room"] = read_json(beside, LARGEST)
    yield f"{row['id']}.json", (json.dumps(told, sort_keys=True) + "\n").encode()
    if picture.is_file():
        yield f"{row['id']}.png", read_bounded(picture, MAX_BYTES)


def _add(tar: tarfile.TarFile, name: str, content: bytes) -> None:
    entry = tarfile.TarInfo(name)  # its time is 1970 and its owner nobody
    entry.size = len(content)
    tar.addfile(entry, io.BytesIO(content))
