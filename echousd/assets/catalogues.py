"""Kinds of libraries: what each says of its models before their files are opened, read with doubt.

A new one is a function that finds it at a path, one that lists its models, and a row of `CATALOGUES`.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Set
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf

from echomodel.files import read_bounded, within_memory
from echousd.assets.licences import licence_beside
from echousd.assets.model_file import MODELS, ModelFile
from echousd.assets.naming import class_by_name, fitted
from echousd.assets.sweethome import read_library
from echousd.stage.apart import fatal

Told = Callable[[str], None]  # is told of what cannot be read, one line each


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


def entries_of(path: Path, tell: Told) -> list[Entry]:
    """The models of the library, folder or model at a path; what cannot be read is told.

    Raises ValueError for a path that is none, and as the kinds of libraries do.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    for find, entries in CATALOGUES:
        found = find(path)
        if found:
            return entries(path, found, tell)
    raise ValueError(f"{path}: neither a folder nor a model nor a library")


# Sweet Home 3D: `.sh3f` archives of OBJ models with a catalogue of names, sizes, creators and licences

LIBRARY = ".sh3f"


def sweet_home(path: Path) -> list[Path]:
    """A library itself, or those somewhere below a folder."""
    return (
        [path]
        if path.suffix == LIBRARY and path.is_file()
        else sorted(p for p in path.rglob(f"*{LIBRARY}") if p.is_file())
    )


def sweet_home_entries(folder: Path, libraries: list[Path], tell: Told) -> list[Entry]:
    """All models; those that were looked at for this project have the class that was found by eye."""
    found: list[Entry] = []
    for library in libraries:
        try:
            for told in read_library(library):
                file = ModelFile(library, library.parent, told.pop("member"))
                found.append(Entry(file=file, category=_sweet_home_class(**told), decided=True, **told))
        except (ValueError, KeyError, OSError) as error:
            tell(f"{library}: {error}")
    return found


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

ABO_TABLE = "3dmodels.csv"
ABO_TAGS = ("style", "material", "color", "brand", "pattern")


def abo(folder: Path) -> Path | None:
    """The table of models somewhere below a folder."""
    return next((p for p in sorted(folder.rglob(f"{ABO_TABLE}*")) if p.name in (ABO_TABLE, f"{ABO_TABLE}.gz")), None)


def abo_entries(folder: Path, table: Path, tell: Told) -> list[Entry]:
    """Models of the table whose files are there."""
    listed: dict[str, Mapping[str, Any]] = {}
    for file in sorted(folder.rglob("listings_*.json*")):
        try:
            for item in json_lines(file):
                listed.setdefault(str(item.get("3dmodel_id", "")), item)
        except ValueError as error:
            tell(str(error))
    found = []
    models = table.parent.parent / "original"
    for row in rows_of(table):
        said, key = Path(row.get("path", "")), row.get("3dmodel_id", "")
        if key and said.name and not said.is_absolute() and ".." not in said.parts and (models / said).is_file():
            item = listed.get(key, {})
            words = _stated(text(item.get("product_type")).replace("_", " ").lower())
            found.append(
                Entry(
                    key, ModelFile(models / said, folder), text(item.get("item_name")) or key, words, turn=np.eye(3),
                    licence="CC-BY-4.0", author="Amazon.com (Amazon Berkeley Objects)",
                    tags=_stated(*(text(item.get(name)) for name in ABO_TAGS)),
                )
            )  # fmt: skip
    if not found:
        tell(f"{table}: none of its models is below {models}")
    return found


# Objaverse with the annotations of objathor: what each object is, what it rests on, how it is turned, its licence

OBJAVERSE_TABLES = ("annotations.json", "annotations.json.gz")
RESTS = (("onCeiling", "ceiling"), ("onWall", "wall"), ("onFloor", "floor"), ("onObject", "surface"))


def objaverse(folder: Path) -> Path | None:
    """The table of annotations in a folder."""
    return next((folder / name for name in OBJAVERSE_TABLES if (folder / name).is_file()), None)


def objaverse_entries(folder: Path, table: Path, tell: Told) -> list[Entry]:
    """Annotated objects whose models are there; pickled ones are never opened."""
    told = json_of(table)
    if not isinstance(told, dict):
        raise ValueError(f"{table}: found a {type(told).__name__}, allowed: uid -> annotation")
    files = {p.stem: p for p in sorted(folder.rglob("*")) if p.suffix.lower() in MODELS}
    known = {uid: said for uid, said in told.items() if uid in files and isinstance(said, dict)}
    if len(known) < len(told):
        tell(f"{table}: {len(told) - len(known)} of {len(told)} objects have no model below {folder}")
    return [_of_objaverse(uid, ModelFile(files[uid], folder), said) for uid, said in known.items()]


def _of_objaverse(uid: str, file: ModelFile, said: Mapping[str, Any]) -> Entry:
    about = said.get("license_info")
    about = about if isinstance(about, dict) else {}
    turn, size, materials = _turned_to_view(said.get("frontView")), said.get("size"), said.get("materials")
    dims = np.array(size, float) / 100 if _is_size(size) else None
    return Entry(
        uid, file, text(said.get("category")) or uid, _stated(text(said.get("category")), text(said.get("synset"))),
        dims=dims if dims is None or turn is None else np.abs(turn @ dims),
        turn=turn,
        licence=str(about.get("license") or said.get("license") or ""),
        author=str(about.get("creator_display_name") or about.get("creator_username") or ""),
        placement=next((word for flag, word in RESTS if said.get(flag)), ""),
        tags=_stated(
            text(said.get("description")), text(said.get("style")),
            *map(str, materials if isinstance(materials, list) else ()),
        ),
    )  # fmt: skip


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
HSSD_NAMES = ("main_category", "wnsynsetkey", "main_wnsynsetkey", "category", "super_category")


def hssd(folder: Path) -> Path | None:
    """A table with the columns `id`, `up` and `front` in a folder or in its `semantics` or `metadata`."""
    for place in (folder, folder / "semantics", folder / "metadata"):
        for path in sorted(place.glob("*.csv")) if place.is_dir() else ():
            if not path.is_file():
                continue
            with path.open(encoding="utf-8", errors="replace") as file:
                columns = [word.strip().strip('"').lower() for word in file.readline(HSSD_HEAD).split(",")]
            if {"id", "up", "front"} <= set(columns):
                return path
    return None


def hssd_entries(folder: Path, table: Path, tell: Told) -> list[Entry]:
    """Models of the table whose files are there; parts of decomposed models are left out."""
    files = {p.stem: p for p in sorted(folder.rglob("*.glb")) if "decomposed" not in p.parts}
    rows = rows_of(table)
    found = [
        Entry(
            row["id"], ModelFile(files[row["id"]], folder), row.get("name") or row["id"],
            _stated(*(row.get(name, "") for name in HSSD_NAMES)),
            turn=_turned_to_axes(row.get("up", ""), row.get("front", "")),
            licence="CC-BY-NC-4.0", author="HSSD (Habitat Synthetic Scenes Dataset)",
            tags=_stated(row.get("style", ""), row.get("material", "")),
        )
        for row in rows
        if row.get("id") in files
    ]  # fmt: skip
    if len(found) < len(rows):
        tell(f"{table}: {len(rows) - len(found)} of {len(rows)} objects have no model below {folder}")
    return found


def _turned_to_axes(up: str, front: str) -> np.ndarray | None:
    """The rotation whose rows are the object's axes, from two vectors as texts `x,y,z`; None where they are none."""
    try:
        high, ahead = (np.array([float(v) for v in said.replace(",", " ").split()]) for said in (up, front))
    except ValueError:
        return None
    if len(high) != 3 or len(ahead) != 3 or not (np.isfinite(high).all() and np.isfinite(ahead).all()):
        return None
    if min(np.linalg.norm(high), np.linalg.norm(ahead)) < 1e-6:
        return None
    high = high / np.linalg.norm(high)
    ahead = ahead - high * (ahead @ high)
    if np.linalg.norm(ahead) < 1e-6:
        return None
    ahead = ahead / np.linalg.norm(ahead)
    return np.stack([np.cross(high, ahead), high, ahead])


# 3D-FUTURE: `model_info.json` and a folder `<model_id>/raw_model.obj` for each; metres, +Y up, front +Z

FUTURE_TABLE = "model_info.json"
FUTURE_FILES = ("raw_model.obj", "normalized_model.obj", "model.obj")


def future3d(folder: Path) -> list[Path]:
    """The tables in a folder and in those right below it."""
    return [p for p in (folder / FUTURE_TABLE, *sorted(folder.glob(f"*/{FUTURE_TABLE}"))) if p.is_file()]


def future3d_entries(folder: Path, tables: list[Path], tell: Told) -> list[Entry]:
    """Models of the tables whose files are there."""
    found: list[Entry] = []
    missing = 0
    for table in tables:
        told = json_of(table)
        for item in told if isinstance(told, list) else ():
            key = str(item.get("model_id", "")) if isinstance(item, dict) else ""
            place = table.parent / key
            path = next((place / name for name in FUTURE_FILES if (place / name).is_file()), None)
            if not key or "/" in key or ".." in key or path is None:
                missing += 1
                continue
            words = _stated(*(str(item.get(name) or "") for name in ("category", "super-category")))
            tags = _stated(*(str(item.get(name) or "") for name in ("style", "theme", "material")))
            found.append(
                Entry(
                    key, ModelFile(path, folder), str(item.get("category") or key), words, metres=1.0, turn=np.eye(3),
                    licence="3D-FUTURE terms of use (non-commercial)", author="Alibaba Group (3D-FUTURE)", tags=tags,
                )
            )  # fmt: skip
    if missing:
        tell(f"{folder / FUTURE_TABLE}: {missing} models of the table are not there")
    return found


# Any folder of models: named as their files or folders, with the licence of a text beside them

STAND_IN = re.compile(r"[_\-. ](collision|collider|convex|physics|lod_?[1-9])\d*$", re.IGNORECASE)
# what follows the name of the other one
SHOWN = re.compile(r"([_\-. ](visual|render|mesh|geo|model|base|high|lod_?0))?", re.IGNORECASE)
GENERIC = ("model", "mesh", "scene", "asset", "object", "geo", "geometry", "raw_model", "normalized_model", "untitled")


def plain_folder(folder: Path) -> bool:
    """Whether a path is a folder, or a model by itself."""
    return folder.is_dir() or folder.suffix.lower() in MODELS


def folder_entries(folder: Path, found: bool, tell: Told) -> list[Entry]:
    """One entry for each model file; parts that a USD model consists of are left to it."""
    if folder.is_file():
        return [_of_folder(folder, folder.parent)]
    files = sorted(p for p in folder.rglob("*") if p.suffix.lower() in MODELS and p.is_file())
    files = [file for file in files if not any(part.startswith(".") for part in file.relative_to(folder).parts)]
    parts = parts_of_others(files)
    beside: dict[Path, set[str]] = {}
    for file in files:
        beside.setdefault(file.parent, set()).add(file.stem)
    files = [file for file in files if not stands_in(file.stem, beside[file.parent])]
    return [_of_folder(file, folder) for file in files if file not in parts]


def _of_folder(file: Path, top: Path) -> Entry:
    key = file.relative_to(top).as_posix()
    stem = file.stem if file.stem.lower() not in GENERIC else file.parent.name
    name = re.sub(r"[_\-.]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", stem)).strip()
    licence, author = licence_beside(file.parent, top)
    group = file.parent.name if file.parent != top else ""
    return Entry(key, ModelFile(file, top), name, group=group, licence=licence, author=author)


def stands_in(stem: str, others: Set[str]) -> bool:
    """Whether a file is what stands in for another one beside it: its collision mesh, or a lower level of detail."""
    found = STAND_IN.search(stem)
    name = stem[: found.start()] if found else stem
    return found is not None and any(other.startswith(name) and SHOWN.fullmatch(other, len(name)) for other in others)


def parts_of_others(files: list[Path]) -> set[Path]:
    """Layers that another layer of a list refers to: payloads, sublayers, parts of one model."""
    known = {file.resolve(): file for file in files}
    found: set[Path] = set()
    layers = [file for file in files if file.suffix.lower() in (".usd", ".usda", ".usdc")]
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
CATALOGUES: tuple[tuple[Callable[[Path], Any], Callable[..., list[Entry]]], ...] = (
    (sweet_home, sweet_home_entries),
    (abo, abo_entries),
    (objaverse, objaverse_entries),
    (hssd, hssd_entries),
    (future3d, future3d_entries),
    (plain_folder, folder_entries),
)


# The tables and lists that they come with, packed or not

BLOCK = 2**16  # a reader makes room for all that it is asked for
MAX_TEXT = 2**30  # bytes of one table, unpacked


def text_of(path: Path) -> str:
    """The text of a file, unpacked where it ends in `.gz`; raises ValueError that names it."""
    try:
        with within_memory(path):
            content = read_bounded(path, MAX_TEXT)
            if path.suffix == ".gz":
                with gzip.open(io.BytesIO(content)) as file:
                    blocks = islice(iter(lambda: file.read(BLOCK), b""), MAX_TEXT // BLOCK + 1)
                    content = b"".join(blocks)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"{path}: cannot be read ({error})") from None
    if len(content) > MAX_TEXT:
        raise ValueError(f"{path}: more than {MAX_TEXT} bytes, allowed for a table: that many")
    return content.decode("utf-8-sig", "replace")


def json_of(path: Path) -> Any:
    """The plain data of a JSON file; raises ValueError that names it."""
    try:
        with within_memory(path):
            return json.loads(text_of(path))
    except (json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: cannot be read as JSON ({error})") from None


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
    try:
        with within_memory(path):
            reader = csv.DictReader(io.StringIO(text_of(path)))
            return [{str(k).strip().lower(): v or "" for k, v in row.items() if isinstance(v, str)} for row in reader]
    except csv.Error as error:
        raise ValueError(f"{path}: cannot be read as a table ({error})") from None


def text(value: Any) -> str:
    """A text from what a catalogue says: a text, or the English one of several languages, or the first."""
    if isinstance(value, str):
        return value
    if isinstance(value, list) and value:
        english = [v for v in value if isinstance(v, dict) and str(v.get("language_tag", "en")).startswith("en")]
        first = (english or value)[0]
        return text(first.get("value", "") if isinstance(first, dict) else first)
    return ""


def _stated(*texts: str) -> tuple[str, ...]:
    """Those of some texts that say something."""
    return tuple(filter(None, texts))
