"""Whether a room's manifest says of its relations what is measured of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pxr import Usd

from echousd.checks.relations import MeasuredRelation
from echousd.checks.validity import Fault
from echousd.folder.journal import digest_of
from echousd.folder.manifest import find_manifest

RULE = "echo:Manifest"
CLEAR = 0.02  # metres or ratio: verdicts of smaller margins may differ between boxes and meshes


def rewritten(stage: Usd.Stage, room: str, relations: Sequence[MeasuredRelation]) -> Iterator[Fault]:
    """Where a manifest says other than what is measured, of a room whose layers are those that it was written with.

    Arguments:
        room: prim path. relations: of the first layout.
    """
    root = Path(stage.GetRootLayer().realPath)
    if not root.is_file() or not root.with_suffix(".json").is_file():
        return
    try:
        manifest = find_manifest(root.parent, root.stem)
    except ValueError as error:
        yield Fault(RULE, room, str(error))
        return
    if manifest is None or manifest["name"] != root.stem or not _as_written(root, manifest["files"]):
        return
    measured = {one.relation.triple: one for one in relations}
    told: dict[tuple[str, ...], str] = {}
    for verdict in _verdicts(manifest):
        triple = tuple(str(verdict.get(word)) for word in ("subject", "predicate", "object"))
        told[triple] = str(verdict.get("state"))
        found = measured.get(triple)  # type: ignore[arg-type]
        if found is None or found.margin is None or abs(found.margin) < CLEAR:
            continue
        if found.kept != (told[triple] == "kept"):
            state = "kept" if found.kept else "broken"
            said = (
                f"{root.stem}.json says that '{found.relation}' is {told[triple]}, it is {state} ({found.margin:+.3f})"
            )
            yield Fault(RULE, room, said)
    for triple, found in measured.items():
        if found.margin is not None and triple not in told:
            yield Fault(RULE, room, f"{root.stem}.json says nothing of '{found.relation}'")
    kept, counts = list(told.values()).count("kept"), manifest.get("relations")
    if not isinstance(counts, dict) or counts.get("kept") != kept:
        yield Fault(RULE, room, f"{root.stem}.json counts {counts} relations, its verdicts say {kept} kept")


def _as_written(root: Path, files: dict[str, str]) -> bool:
    """Whether the root layer and the layers below it are those that a manifest names."""
    layers = [name for name in files if name == root.name or name.startswith("layers/")]
    return all(digest_of(root.parent / name) == files[name] for name in layers)


def _verdicts(manifest: dict[str, Any]) -> list[dict[str, Any]]:
    found = manifest.get("verdicts")
    return [verdict for verdict in found if isinstance(verdict, dict)] if isinstance(found, list) else []
