"""A room's manifest `<name>.json`, read back with doubt, as anybody may have sent or edited it (no pxr here)."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from echomodel.late import Late
from echousd.folder.within import check_links, inside
from echousd.graph.values import IDENTIFIER
from echousd.options import MAX_SEED, Look

validation_message = Late("echousd.invalid:validation_message")

MANIFEST_KEY = "echousd_room"
LARGEST = 64 * 2**20  # bytes of a manifest or journal that are read

Name = Annotated[str, Field(pattern=f"^{IDENTIFIER.pattern}$", max_length=255)]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]*$", max_length=128)]


class Step(BaseModel, strict=True):
    """One edit that can be taken back: what it said, the archive with what it replaced, and the files that it added.

    `leaves` are the digests of what it wrote of files that are not ours alone, such as a root layer that it merged.
    """

    number: Annotated[int, Field(ge=1)]
    steps: list[str]
    restores: Annotated[str, Field(max_length=4096)]
    adds: list[str]
    leaves: dict[str, Digest] = Field({})


class Manifest(Look, extra="allow", strict=True, frozen=True):
    """The fields that are read back; others are kept as they are. `echousd.make.save.manifest_of` writes them."""

    echousd_room: Literal[1]
    name: Name
    files: dict[str, Digest]
    assets: dict[str, Name] = Field({})
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 0
    preset: str = "compact"
    model: str = ""
    shapes: str = "sdf"
    source: str = ""
    meshes: dict[str, dict[str, Any]] = Field({})
    history: list[Step] = Field([])
    store: Annotated[str, Field(max_length=4096)] = ""
    stored: dict[str, Annotated[str, Field(pattern=r"^[0-9a-f]{32}$")]] = Field({})


def find_manifest(folder: Path, root: str = "") -> dict[str, Any] | None:
    """The manifest of the room in `folder`, or None if there is none of ours.

    A manifest lies beside its room under the room's name; copies under other names are nobody's.

    Arguments:
        folder: the room's folder.
        root: name of the room that is preferred where there are several, the folder's own otherwise.

    Raises ValueError for one that is not valid, or that names a file outside of the folder.
    """
    found: dict[str, dict[str, Any]] = {}
    wrong: list[str] = []
    for path in sorted(folder.glob("*.json")):
        raw = _raw(folder, path)
        if raw is None:
            continue
        try:
            manifest = read_manifest(path, raw)
        except ValueError as error:
            wrong.append(str(error))
            continue
        if manifest["name"] == path.stem:
            found[path.stem] = manifest
    if not found and wrong:
        raise ValueError(wrong[0])
    rooted = [name for name in found if (folder / f"{name}.usda").is_file()]
    preferred = [name for name in (root, folder.name) if name in found] + rooted + list(found)
    return found[preferred[0]] if preferred else None


def read_manifest(path: Path, raw: dict[str, Any]) -> dict[str, Any]:
    """The manifest in the file at `path`, checked; raises ValueError that names the entry."""
    try:
        manifest = Manifest.model_validate(raw)
    except ValidationError as error:
        raise ValueError(f"{path}: {validation_message(error, Manifest)}") from None
    for name in manifest.files:
        inside(path.parent, name, f"{path}: files")
    for step in manifest.history:
        for name in (step.restores, *step.adds, *step.leaves):
            inside(path.parent, name, f"{path}: history")
    return manifest.model_dump()


def _raw(folder: Path, path: Path) -> dict[str, Any] | None:
    """What a JSON file holds if it may be a manifest."""
    try:
        check_links(folder, path, str(path))
        if not path.is_file() or path.stat().st_size > LARGEST:
            return None
        raw = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return raw if isinstance(raw, dict) and MANIFEST_KEY in raw and isinstance(raw.get("files"), dict) else None
