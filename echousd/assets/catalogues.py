"""Kinds of libraries: what each says of its models before their files are opened, read with doubt.

A new one is a function that finds its tables at a path, one that lists their models, and a row of `CATALOGUES`.
"""

import csv
import gzip
import io
import json
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf

from echomodel.bounded import read_bounded, unpacking
from echomodel.files import raising, within_memory
from echousd.assets.licences import licence_beside
from echousd.assets.model_file import ModelFile
from echousd.assets.naming import class_by_name, fitted
from echousd.assets.reference import MODELS
from echousd.naming import LAYER_FORMS
from echousd.stage.apart import fatal

Tell = Callable[[str], None]  # is told of what cannot be read, one line each
Models = Iterator[tuple[Path | None, dict[str, Any]]]  # file, None where it is not there; fields of `Entry`


@dataclass(frozen=True, eq=False)
class Entry:
    """One model on offer.

    Arguments:
        key: unique in the catalogue. file: where it lies.
        name: what it is called. words: of its class, the surest first. group: the shelf it lies on.
        category: of the vocabulary, where the catalogue says it for certain. decided: whether it does, even where that
            is none.
        dims: width, height, depth in metres after `turn`, None where only the mesh knows.
        metres: per unit, None where the file or its size says.
        turn: (3, 3) the model's axes to the object frame, None where nobody says.
        placement: as in `AssetRecord`, "" where the category says it.
    """

    key: str
    file: ModelFile
    name: str = ""
    words: tuple[str, ...] = ()
    group: str = ""
    category: str = ""
    decided: bool = False
    dims: np.ndarray | None = None
    metres: float | None = None
    turn: np.ndarray | None = None
    licence: str = ""
    author: str = ""
    placement: str = ""
    tags: tuple[str, ...] = ()


def entries_of(path: Path, tell: Tell) -> list[Entry]:
    """The models of the library, folder or model at a path; what cannot be read is told.

    Raises ValueError for a path that is none.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    for find, models in CATALOGUES:
        tables = find(path)
        if tables:
            return [entry for table in tables for entry in _entries(path, table, models(path, table, tell), tell)]
    raise ValueError(f"{path}: neither a folder nor a model nor a library")


def _entries(path: Path, table: Path, models: Models, tell: Tell) -> list[Entry]:
    found: list[Entry] = []
    missing, top = 0, path if path.is_dir() else path.parent
    try:
        for file, fields in models:
            missing += file is None
            if file is not None:
                found.append(Entry(file=ModelFile(file, top, fields.pop("member", "")), **fields))
    except (ValueError, KeyError, OSError) as error:
        tell(str(error) if str(error).startswith(str(table)) else f"{table}: {error}")
    if missing:
        tell(f"{table}: {missing} of {missing + len(found)} models are not below {path}")
    return found


# Sweet Home 3D: `.sh3f` archives of OBJ models with a catalogue of names, sizes, creators and licences
SWEET_HOME = "PluginFurnitureCatalog.properties"
NOTICE = "LICENSE.TXT"
UNPACKED = 64 * 2**20  # bytes of each


def sweet_home(path: Path) -> list[Path]:
    """A library itself, or those somewhere below a folder."""
    return [p for p in (path, *sorted(path.rglob("*.sh3f"))) if p.suffix == ".sh3f" and p.is_file()]


def sweet_home_models(path: Path, library: Path, tell: Tell) -> Models:
    """All models; those that were looked at for this project have the class that was found by eye."""
    for fields in read_library(library):
        yield library, {"category": _sweet_home_class(**fields), "decided": True, **fields}


def read_library(path: Path) -> list[dict[str, Any]]:
    """What a furniture library says of its models; raises ValueError for a file that is none.

    Of each: `key`, `name`, `group`, `dims` (3) in metres, `licence`, `author`, `member` in the archive, and `turn`
    (3, 3), which brings it upright and its front to +Z.
    """
    if not path.is_file():
        raise ValueError(f"{path}: not a furniture library (.sh3f is a zip archive)")
    with unpacking(path), within_memory(path), zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        if SWEET_HOME not in names:
            raise ValueError(f"{path}: not a furniture library, it holds no {SWEET_HOME}")
        for name in names & {SWEET_HOME, NOTICE}:
            if archive.getinfo(name).file_size > UNPACKED:
                raise ValueError(f"{path}: {name} of {archive.getinfo(name).file_size} bytes, allowed: {UNPACKED}")
        text = archive.read(SWEET_HOME).decode("latin-1")
        notice = archive.read(NOTICE).decode("latin-1") if NOTICE in names else ""
    head, items = _properties(text)
    licence = _unescaped(head.get("license", "")) or _licence_in(notice)
    return [model for item in items if (model := _sweet_home_model(item, path.stem, licence, head.get("provider", "")))]


def _sweet_home_model(item: Mapping[str, str], library: str, licence: str, provider: str) -> dict[str, Any] | None:
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
        "key": f"{library}/{Path(member).stem}", "name": _unescaped(name), "group": item.get("category", ""),
        "dims": dims, "member": member, "turn": turn,
        "licence": licence, "author": _unescaped(item.get("creator", provider)),
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


def _unescaped(text: str) -> str:
    """Escapes of a properties file resolved."""
    return re.sub(r"\\u([0-9a-fA-F]{4})", lambda m: chr(int(m[1], 16)), text).strip()


def _licence_in(notice: str) -> str:
    """What a licence text calls the licence."""
    text = " ".join(notice.split())
    named = re.search(r"Creative Commons [A-Z0-9][^:;,]*?licen[cs]e", text) or re.search(r"public domain", text, re.I)
    return named[0] if named else (text[:80] or "unknown")


def _sweet_home_class(key: str, name: str, group: str, dims: np.ndarray, **_: Any) -> str:
    category = class_by_name(name, group, dims)
    category = "" if category and fitted(category, name, group) else category
    known = reviewed().get(key, {})
    return "" if known.get("use") == "0" else known.get("class", category)


@cache
def reviewed() -> dict[str, dict[str, str]]:
    """What was found by eye of models of Sweet Home 3D's libraries: key -> `class`, or `use` 0."""
    review = json.loads(Path(__file__).with_name("mesh_review.json").read_text("utf-8"))
    return dict(review["models"])


# Amazon Berkeley Objects: `3dmodels/metadata/3dmodels.csv.gz`, glb models, and listings that name them


def abo(folder: Path) -> list[Path]:
    """The table of models somewhere below a folder."""
    return [p for p in sorted(folder.rglob("3dmodels.csv*")) if p.name in ("3dmodels.csv", "3dmodels.csv.gz")][:1]


def abo_models(folder: Path, table: Path, tell: Tell) -> Models:
    """Models of the table, and what listings say of them."""
    listed: dict[str, Mapping[str, Any]] = {}
    for file in sorted(folder.rglob("listings_*.json*")):
        try:
            for item in json_lines(file):
                listed.setdefault(str(item.get("3dmodel_id", "")), item)
        except ValueError as error:
            tell(str(error))
    for row in rows_of(table):
        key, place = row.get("3dmodel_id", ""), row.get("path", "")
        item = listed.get(key, {})
        yield _there(table.parent.parent / "original", key and place), {
            "key": key, "name": text(item.get("item_name")) or key, "turn": np.eye(3),
            "words": tuple(word.replace("_", " ").lower() for word in texts(item, "product_type")),
            "licence": "CC-BY-4.0", "author": "Amazon.com (Amazon Berkeley Objects)",
            "tags": texts(item, "style", "material", "color", "brand", "pattern"),
        }  # fmt: skip


# Objaverse with the annotations of objathor: what each object is, what it rests on, how it is turned, its licence

RESTS = (("onCeiling", "ceiling"), ("onWall", "wall"), ("onFloor", "floor"), ("onObject", "surface"))


def objaverse(folder: Path) -> list[Path]:
    """The table of annotations in a folder."""
    return [p for p in (folder / "annotations.json", folder / "annotations.json.gz") if p.is_file()][:1]


def objaverse_models(folder: Path, table: Path, tell: Tell) -> Models:
    """Annotated objects; pickled ones are never opened."""
    annotations = json_of(table)
    if not isinstance(annotations, dict):
        raise ValueError(f"{table}: found a {type(annotations).__name__}, allowed: uid -> annotation")
    files = {p.stem: p for p in sorted(folder.rglob("*")) if p.suffix.lower() in MODELS}
    for uid, row in annotations.items():
        if not isinstance(row, dict):
            continue
        about = row.get("license_info")
        about = about if isinstance(about, dict) else {}
        turn, size, materials = _turned_to_view(row.get("frontView")), row.get("size"), row.get("materials")
        dims = np.array(size, float) / 100 if _is_size(size) else None
        yield files.get(uid), {
            "key": uid, "name": text(row.get("category")) or uid, "words": texts(row, "category", "synset"),
            "dims": dims if dims is None or turn is None else np.abs(turn @ dims), "turn": turn,
            "licence": str(about.get("license") or row.get("license") or ""),
            "author": str(about.get("creator_display_name") or about.get("creator_username") or ""),
            "placement": next((word for flag, word in RESTS if row.get(flag)), ""),
            "tags": (*texts(row, "description", "style"), *map(str, materials if isinstance(materials, list) else ())),
        }  # fmt: skip


def _turned_to_view(view: Any) -> np.ndarray | None:
    """From `frontView`: the number of the quarter view, anticlockwise, that shows the front."""
    if not isinstance(view, int) or isinstance(view, bool) or not 0 <= view < 4:
        return None
    c, s = round(np.cos(-view * np.pi / 2)), round(np.sin(-view * np.pi / 2))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], float)


def _is_size(size: Any) -> bool:
    numbers = isinstance(size, list) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in size)
    return numbers and len(size) == 3 and all(0 < v < 1e5 for v in size)


# Habitat Synthetic Scenes (HSSD): glb models and a table of their categories, their up and their front

HSSD_HEAD = 4096  # characters of a table that may name its columns


def hssd(folder: Path) -> list[Path]:
    """A table with the columns `id`, `up` and `front` in a folder or in its `semantics` or `metadata`."""
    for path in (path for below in ("", "semantics", "metadata") for path in sorted((folder / below).glob("*.csv"))):
        if path.is_file():
            with path.open(encoding="utf-8", errors="replace") as file:
                columns = [word.strip().strip('"').lower() for word in file.readline(HSSD_HEAD).split(",")]
            if {"id", "up", "front"} <= set(columns):
                return [path]
    return []


def hssd_models(folder: Path, table: Path, tell: Tell) -> Models:
    """Models of the table; parts of decomposed models are left out."""
    files = {p.stem: p for p in sorted(folder.rglob("*.glb")) if "decomposed" not in p.parts}
    for row in rows_of(table):
        yield files.get(row.get("id", "")), {
            "key": row.get("id", ""), "name": row.get("name") or row.get("id", ""),
            "words": texts(row, "main_category", "wnsynsetkey", "main_wnsynsetkey", "category", "super_category"),
            "turn": _turned_to_axes(row.get("up", ""), row.get("front", "")),
            "licence": "CC-BY-NC-4.0", "author": "HSSD (Habitat Synthetic Scenes Dataset)",
            "tags": texts(row, "style", "material"),
        }  # fmt: skip


def _turned_to_axes(up: str, front: str) -> np.ndarray | None:
    """The rotation whose rows are the object's axes, from two vectors as texts `x,y,z`; None where they are none."""
    try:
        axes = np.array([[float(v) for v in axis.replace(",", " ").split()] for axis in (up, front)])
    except ValueError:
        return None
    if axes.shape != (2, 3) or not np.isfinite(axes).all():
        return None
    high, ahead = axes
    side = np.cross(high, ahead)
    if min(np.linalg.norm(high), np.linalg.norm(side)) < 1e-6:
        return None
    return np.stack([row / np.linalg.norm(row) for row in (side, high, np.cross(side, high))])


# 3D-FUTURE: `model_info.json` and a folder `<model_id>/raw_model.obj` for each; metres, +Y up, front +Z


def future3d(folder: Path) -> list[Path]:
    """The tables in a folder and in those right below it."""
    return [p for p in (folder / "model_info.json", *sorted(folder.glob("*/model_info.json"))) if p.is_file()]


def future3d_models(folder: Path, table: Path, tell: Tell) -> Models:
    """Models of a table."""
    rows = json_of(table)
    for item in rows if isinstance(rows, list) else ():
        item = item if isinstance(item, dict) else {}
        key = str(item.get("model_id", ""))
        names = ("raw_model.obj", "normalized_model.obj", "model.obj") if key else ()
        yield next((path for name in names if (path := _there(table.parent, f"{key}/{name}"))), None), {
            "key": key, "name": text(item.get("category")) or key, "words": texts(item, "category", "super-category"),
            "metres": 1.0, "turn": np.eye(3), "licence": "3D-FUTURE terms of use (non-commercial)",
            "author": "Alibaba Group (3D-FUTURE)", "tags": texts(item, "style", "theme", "material"),
        }  # fmt: skip


# Any folder of models: named as their files or folders, with the licence of a text beside them

STAND_IN = re.compile(r"[_\-. ](collision|collider|convex|physics|lod_?[1-9])\d*$", re.IGNORECASE)
# what follows the name of the other one
SHOWN = re.compile(r"([_\-. ](visual|render|mesh|geo|model|base|high|lod_?0))?", re.IGNORECASE)
GENERIC = ("model", "mesh", "scene", "asset", "object", "geo", "geometry", "raw_model", "normalized_model", "untitled")


def plain_folder(path: Path) -> list[Path]:
    """A folder, or a model by itself."""
    return [path] if path.is_dir() or path.suffix.lower() in MODELS else []


def folder_models(path: Path, folder: Path, tell: Tell) -> Models:
    """Every model file; parts that a USD model consists of are left to it."""
    if folder.is_file():
        yield folder, _of_folder(folder, folder.parent)
        return
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in MODELS and p.is_file())
    files = [file for file in files if not any(part.startswith(".") for part in file.relative_to(folder).parts)]
    parts = parts_of_others(files)
    beside: dict[Path, set[str]] = {}
    for file in files:
        beside.setdefault(file.parent, set()).add(file.stem)
    for file in files:
        if file not in parts and not stands_in(file.stem, beside[file.parent]):
            yield file, _of_folder(file, folder)


def _of_folder(file: Path, top: Path) -> dict[str, Any]:
    stem = file.stem if file.stem.lower() not in GENERIC else file.parent.name
    name = re.sub(r"[_\-.]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", stem)).strip()
    licence, author = licence_beside(file.parent, top)
    group = file.parent.name if file.parent != top else ""
    return {"key": file.relative_to(top).as_posix(), "name": name, "group": group, "licence": licence, "author": author}


def stands_in(stem: str, others: Set[str]) -> bool:
    """Whether a file is what stands in for another one beside it: its collision mesh, or a lower level of detail."""
    found = STAND_IN.search(stem)
    name = stem[: found.start()] if found else stem
    return found is not None and any(other.startswith(name) and SHOWN.fullmatch(other, len(name)) for other in others)


def parts_of_others(files: list[Path]) -> set[Path]:
    """Layers that another layer of a list refers to: payloads, sublayers, parts of one model."""
    known = {file.resolve(): file for file in files}
    found: set[Path] = set()
    layers = [file for file in files if file.suffix.lower() in LAYER_FORMS]
    deadly = fatal(layers)
    for file in layers:
        if file in deadly:
            continue
        try:
            layer = Sdf.Layer.OpenAsAnonymous(str(file))
        except Tf.ErrorException:
            continue
        for name in layer.GetCompositionAssetDependencies():
            other = (file.parent / name).resolve()
            if other in known and known[other] != file:
                found.add(known[other])
    return found


# The first that a path is one of counts; a plain folder is everything else.
CATALOGUES: tuple[tuple[Callable[[Path], list[Path]], Callable[[Path, Path, Tell], Models]], ...] = (
    (sweet_home, sweet_home_models),
    (abo, abo_models),
    (objaverse, objaverse_models),
    (hssd, hssd_models),
    (future3d, future3d_models),
    (plain_folder, folder_models),
)


# The tables and lists that they come with, packed or not

BLOCK = 2**16  # a reader makes room for all that it is asked for
MAX_TEXT = 2**30  # bytes of one table, unpacked


def text_of(path: Path) -> str:
    """The text of a file, unpacked where it ends in `.gz`; raises ValueError that names it."""
    with raising(f"{path}: cannot be read", OSError, EOFError, zlib.error), within_memory(path):
        content = read_bounded(path, MAX_TEXT)
        if path.suffix == ".gz":
            with gzip.open(io.BytesIO(content)) as file:
                blocks = islice(iter(lambda: file.read(BLOCK), b""), MAX_TEXT // BLOCK + 1)
                content = b"".join(blocks)
    if len(content) > MAX_TEXT:
        raise ValueError(f"{path}: more than {MAX_TEXT} bytes, allowed for a table: that many")
    return content.decode("utf-8-sig", "replace")


def json_of(path: Path) -> Any:
    """The plain data of a JSON file; raises ValueError that names it."""
    with raising(f"{path}: cannot be read as JSON", json.JSONDecodeError, RecursionError), within_memory(path):
        return json.loads(text_of(path))


def json_lines(path: Path) -> Iterator[Mapping[str, Any]]:
    """The mappings of a file with one in each line; lines that are none are left out."""
    for line in text_of(path).splitlines():
        try:
            found = json.loads(line) if line.strip() else None
        except (json.JSONDecodeError, RecursionError):
            continue
        if isinstance(found, dict):
            yield found


def rows_of(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV table, its column names in lower case; raises ValueError that names it."""
    with raising(f"{path}: cannot be read as a table", csv.Error), within_memory(path):
        reader = csv.DictReader(io.StringIO(text_of(path)))
        return [{str(k).strip().lower(): v or "" for k, v in row.items() if isinstance(v, str)} for row in reader]


def text(value: Any) -> str:
    """A text from what a catalogue says: a text, or the English one of several languages, or the first."""
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value:
        english = [v for v in value if isinstance(v, dict) and str(v.get("language_tag", "en")).startswith("en")]
        first = (english or value)[0]
        return text(first.get("value", "") if isinstance(first, dict) else first)
    return ""


def texts(row: Mapping[str, Any], *names: str) -> tuple[str, ...]:
    """What some fields of a catalogue say, those that say nothing left out."""
    return tuple(filter(None, (text(row.get(name)) for name in names)))


def _there(folder: Path, place: str) -> Path | None:
    """The file at a place that a table names below a folder, None where there is none."""
    relative = Path(place)
    inside = relative.name and not relative.is_absolute() and ".." not in relative.parts
    return folder / relative if inside and (folder / relative).is_file() else None
