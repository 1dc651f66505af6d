"""Sweet Home 3D: `.sh3f` archives of OBJ models with a catalogue of names, sizes, creators and licences."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.files import unpacking, within_memory

CATALOGUE = "PluginFurnitureCatalog.properties"
NOTICE = "LICENSE.TXT"
MAX_TEXT = 64 * 2**20  # bytes of one of them


def read_library(path: Path) -> list[dict[str, Any]]:
    """What a furniture library says of its models; raises ValueError for a file that is none.

    Of each: `key`, `name`, `group`, `dims` (3) in metres, `licence`, `author`, `member` in the archive, and `turn`
    (3, 3), which brings it upright and its front to +Z.
    """
    if not path.is_file():
        raise ValueError(f"{path}: not a furniture library (.sh3f is a zip archive)")
    with unpacking(path), within_memory(path), zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        if CATALOGUE not in names:
            raise ValueError(f"{path}: not a furniture library, it holds no {CATALOGUE}")
        for name in names & {CATALOGUE, NOTICE}:
            if archive.getinfo(name).file_size > MAX_TEXT:
                raise ValueError(f"{path}: {name} of {archive.getinfo(name).file_size} bytes, allowed: {MAX_TEXT}")
        text = archive.read(CATALOGUE).decode("latin-1")
        notice = archive.read(NOTICE).decode("latin-1") if NOTICE in names else ""
    head, items = _properties(text)
    licence = _plain(head.get("license", "")) or _licence_in(notice)
    return [told for item in items if (told := _model(item, path.stem, licence, head.get("provider", "")))]


def _model(item: Mapping[str, str], library: str, licence: str, provider: str) -> dict[str, Any] | None:
    """One model, None for what is no model of its own or nothing that could stand anywhere."""
    try:
        dims = np.array([float(item[axis]) for axis in ("width", "height", "depth")]) / 100
        turn = np.array([float(v) for v in item.get("modelRotation", "1 0 0 0 1 0 0 0 1").split()]).reshape(3, 3)
        name, member = item["name"], item["model"].lstrip("/")
    except (KeyError, ValueError):
        return None
    if not ((dims > 0) & (dims < 1e3)).all() or not np.isfinite(turn).all():
        return None
    return {
        "key": f"{library}/{Path(member).stem}", "name": _plain(name), "group": item.get("category", ""), "dims": dims,
        "licence": licence, "author": _plain(item.get("creator", provider)), "member": member, "turn": turn,
    }  # fmt: skip


def _properties(text: str) -> tuple[dict[str, str], list[dict[str, str]]]:
    """A Java properties file: keys without number, and one dictionary per `key#number`."""
    head: dict[str, str] = {}
    items: dict[int, dict[str, str]] = {}
    for line in _joined(text):
        match = re.match(r"\s*([A-Za-z]+)(?:#(\d+))?\s*=\s*(.*?)\s*$", line)
        if match and match[2]:
            items.setdefault(int(match[2]), {})[match[1]] = match[3]
        elif match:
            head[match[1]] = match[3]
    return head, [items[number] for number in sorted(items)]


def _joined(text: str) -> Iterator[str]:
    """Lines without comments, those that end in a backslash joined with the next."""
    held = ""
    for line in text.splitlines():
        if not held and line.lstrip().startswith(("#", "!")):
            continue
        held += line.lstrip() if held else line
        if held.endswith("\\"):
            held = held[:-1]
            continue
        yield held
        held = ""


def _plain(text: str) -> str:
    """Escapes of a properties file resolved."""
    return re.sub(r"\\u([0-9a-fA-F]{4})", lambda m: chr(int(m[1], 16)), text).strip()


def _licence_in(notice: str) -> str:
    """What a licence text calls the licence."""
    text = " ".join(notice.split())
    named = re.search(r"Creative Commons [A-Z0-9][^:;,]*?licen[cs]e", text) or re.search(r"public domain", text, re.I)
    return named[0] if named else (text[:80] or "unknown")
