"""Where real meshes come from: Sweet Home 3D libraries (`.sh3f`) with their catalogue, or any folder of mesh files."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh

from echomodel.files import unpacking, within_memory

MESH_FILES = (".obj", ".glb", ".gltf", ".ply", ".stl")
CATALOGUE = "PluginFurnitureCatalog.properties"
NOTICE = "LICENSE.TXT"
MAX_TEXT = 64 * 2**20  # bytes of one of them
Loader = Callable[[Path], trimesh.Trimesh]


@dataclass(frozen=True, eq=False)
class MeshEntry:
    """One model on offer: what its source tells of it, and where its triangles lie.

    `size` (3,) is width x, height y, depth z in metres, or None where only the mesh knows; `turn` (3, 3) brings the
    model upright and its front to +Z.
    """

    key: str
    name: str
    group: str
    size: np.ndarray | None
    licence: str
    creator: str
    source: Path
    member: str
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))


def read_library(path: Path) -> list[MeshEntry]:
    """Entries of a Sweet Home 3D furniture library; raises ValueError for a file that is none."""
    if not path.is_file():
        raise ValueError(f"{path}: not a furniture library (.sh3f is a zip archive)")
    with unpacking(path), within_memory(path):
        return _library(path)


def _library(path: Path) -> list[MeshEntry]:
    with zipfile.ZipFile(path) as archive:
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
    entries = []
    for item in items:
        missing = [key for key in ("name", "model", "width", "height", "depth") if key not in item]
        if missing:
            continue  # not a model of its own
        key = f"{path.stem}/{Path(item['model']).stem}"
        try:
            centimetres = [float(item[axis]) for axis in ("width", "height", "depth")]
            turn = np.array([float(v) for v in item.get("modelRotation", "1 0 0 0 1 0 0 0 1").split()]).reshape(3, 3)
        except ValueError:
            continue
        if not all(0 < length < 1e5 for length in centimetres) or not np.isfinite(turn).all():
            continue  # nothing that could stand anywhere
        name, group, creator = item["name"], item.get("category", ""), item.get("creator", head.get("provider", ""))
        entry = MeshEntry(key, _plain(name), group, np.array(centimetres) / 100, licence, _plain(creator), path,
                          item["model"].lstrip("/"), turn)  # fmt: skip
        entries.append(entry)
    return entries


def read_folder(path: Path, suffixes: tuple[str, ...] = MESH_FILES) -> list[MeshEntry]:
    """One entry per mesh file below a folder, named as the file; a LICENSE text beside it tells the licence."""
    entries = []
    for file in sorted(p for p in path.rglob("*") if p.suffix.lower() in suffixes):
        notices = [p for p in file.parent.iterdir() if p.stem.upper() in ("LICENSE", "LICENCE") and p.is_file()]
        licence = _licence_in(notices[0].read_text("utf-8", errors="replace")) if notices else "unknown"
        name = re.sub(r"[_\-]+", " ", file.stem)
        key = file.relative_to(path).with_suffix("").as_posix()
        entries.append(MeshEntry(key, name, file.parent.name, None, licence, "unknown", file, ""))
    return entries


def load_mesh(entry: MeshEntry, loaders: Mapping[str, Loader] | None = None) -> trimesh.Trimesh:
    """Triangles of an entry, upright, front to +Z, scaled to its size in metres, standing on y = 0.

    Arguments:
        entry: from `read_library` or `read_folder`.
        loaders: for suffixes that trimesh does not read, such as ".usd": path -> mesh in metres, +Y up.

    Raises ValueError naming the file when it holds no triangles or cannot be read.
    """
    where = f"{entry.source}{'!' + entry.member if entry.member else ''}"
    suffix = Path(entry.member or entry.source).suffix.lower()
    try:
        with within_memory(entry.source, where):
            mesh = _loaded(entry, suffix, loaders or {})
    except Exception as error:  # a reader may fail with anything on a broken file
        raise ValueError(f"{where}: cannot be read ({type(error).__name__}: {error})") from None
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        raise ValueError(f"{where}: holds no triangles")
    plain = trimesh.Trimesh(np.asarray(mesh.vertices, float) @ entry.turn.T, mesh.faces, process=False)
    plain.update_faces(plain.area_faces > 0)
    plain.remove_unreferenced_vertices()
    if len(plain.faces) == 0 or not np.isfinite(plain.vertices).all():
        raise ValueError(f"{where}: holds no triangles with an area")
    lower, upper = plain.bounds
    if entry.size is not None:
        plain.apply_translation(-lower)
        plain.apply_scale(np.asarray(entry.size) / np.maximum(upper - lower, 1e-6))
        lower, upper = plain.bounds
    plain.apply_translation([-(lower[0] + upper[0]) / 2, -lower[1], -(lower[2] + upper[2]) / 2])
    return plain


def _loaded(entry: MeshEntry, suffix: str, loaders: Mapping[str, Loader]) -> object:
    if entry.member:
        with zipfile.ZipFile(entry.source) as archive:
            data = io.BytesIO(archive.read(entry.member))
        return trimesh.load(data, file_type=suffix[1:], force="mesh", process=False, skip_materials=True)
    if suffix in loaders:
        return loaders[suffix](entry.source)
    return trimesh.load(entry.source, force="mesh", process=False)


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
