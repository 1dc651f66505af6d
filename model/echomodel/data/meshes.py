"""Sets of real meshes: a reviewable table of classes and fronts, flood-filled distances, splits, attribution."""

from __future__ import annotations

import csv
import hashlib
import json
import os
import re
import shutil
import subprocess
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
import trimesh

from echomodel.data.catalogues import MESH_FILES, Loader, MeshEntry, load_mesh, read_folder, read_library
from echomodel.data.shapeset import ShapeRecord, ShapeSet, finish_set, write_shard
from echomodel.data.sheet import thumbnail
from echomodel.files import whole_file, write_picture, write_text
from echomodel.progress import StepListener
from echomodel.tsdf import tsdf_from_mesh
from echomodel.vocabulary import vocabulary

HELD_OUT = 0.2
COLUMNS = ("key", "class", "use", "yaw", "name", "width", "height", "depth", "split", "licence", "creator")
# Catalogue groups and words that are no furniture of ours although a rule below would match.
OTHER_GROUPS = ("Vehicles", "Characters", "Doors and windows", "Staircases")
OTHER = (
    r"changing|christmas|high chair|pool|football|tennis|\bfan\b|wheel ?chair|lamppost|street|park |porch",
    r"outdoor|stone|flashlight|washbasin|ladder|carpet|contemporary|class ?seat|remote|abdominal|workbench|upper",
    r"hood|sink|locker|mattress|hospital|sleeping|double vanity|railing|window|tatami|candle|fluorescent",
    r"track light|lantern|camping|deck|relax|beach|swing|plant box|flower box|socket|opened|tray|child hut",
    r"holder|telephone|table-?cloth$|bonsai|doll",
)
# First match wins: pattern on the name, class; with a question mark the size decides.
RULES: tuple[tuple[str, str], ...] = (
    ("|".join(OTHER), "none"),
    (r"dressing table|vanity", "dressing_table"),
    (r"bunk|crib|baby bed|child(ren)?('s)? bed|junior|mezzanine|captain", "kids_bed"),
    (r"day ?bed", "chaise_longue_sofa"),
    (r"bedside|night ?stand", "nightstand"),
    (r"futon(?! couch)|\bbed\b", "bed?"),
    (r"corner sofa|l.?shaped", "l_shaped_sofa"),
    (r"sofa|couch", "sofa?"),
    (r"ottoman|puff|pouf", "ottoman"),
    (r"bar (chair|stool)", "bar_stool"),
    (r"bench$", "bench"),
    (r"arm ?chair", "armchair"),
    (r"stool", "stool?"),
    (r"chair|\bseat\b", "chair?"),
    (r"coffee table", "coffee_table"),
    (r"television cabinet|tv ?stand", "tv_stand"),
    (r"\btv\b|television", "tv"),
    (r"\bdesk\b(?! lamp)|technical table", "desk"),
    (r"hanging light|pendant|chandelier", "pendant_lamp"),
    (r"ceiling lamp", "ceiling_lamp"),
    (r"wall (light|lamp|spot)", "wall_lamp"),
    (r"\blamp\b|\blight\b", "lamp?"),
    (r"\btable\b", "table?"),
    (r"wardrobe", "wardrobe"),
    (r"cupboard", "cabinet"),
    (r"bookcase", "bookshelf"),
    (r"shel(f|ves)", "shelf"),
    (r"dresser|chest$", "dresser"),
    (r"cabinet", "cabinet"),
    (r"plant|ficus|yucca|bamboo|cactus|spathiphyllum|orchid|lily|tulip|flowers", "plant"),
)


@dataclass(frozen=True)
class MeshRow:
    """One line of the table: what a mesh is taken for. `yaw` (degrees) is turned away before use."""

    key: str
    category: str
    use: bool
    yaw: float
    name: str
    size: tuple[float, float, float]
    split: str
    licence: str
    creator: str


def class_by_name(name: str, group: str, size: Sequence[float] | np.ndarray) -> str:
    """Category for a model's name, group and size (3,) in metres, or "" where it is no furniture of the vocabulary."""
    text = name.lower()
    width, height, _ = size
    if group in OTHER_GROUPS or (group == "Exterior" and not re.search(r"chair|table|sofa|bench", text)):
        return ""
    word = next((category for pattern, category in RULES if re.search(pattern, text)), "none")
    low = "side_table" if width < 0.65 else "coffee_table"
    choice = {
        "none": "",
        "bed?": "double_bed" if width >= 1.3 else "single_bed",
        "sofa?": "multi_seat_sofa" if width >= 1.75 else "loveseat_sofa",
        "stool?": "bar_stool" if height > 0.62 else "stool",
        "chair?": "office_chair" if group == "Office" and height > 0.75 else "chair",
        "table?": "dining_table" if height >= 0.62 and width >= 0.7 else low,
        "lamp?": "floor_lamp" if height > 1.0 else "table_lamp",
    }
    return choice.get(word, word)


def draft_table(entries: Sequence[MeshEntry], review: Mapping[str, dict[str, str]] | None = None) -> list[MeshRow]:
    """A table for review: classes by name, corrected by `review` (key -> columns), a fifth of each class held out.

    Entries without a size of their own are left out of the size-dependent guesses (their mesh is not opened here).
    """
    review = reviewed() if review is None else review
    rows = []
    for entry in entries:
        size = np.ones(3) if entry.size is None else entry.size
        known = review.get(entry.key, {})
        category = known.get("class", class_by_name(entry.name, entry.group, size))
        x, y, z = (round(float(v), 3) for v in size)
        use, yaw = bool(category) and known.get("use", "1") != "0", float(known.get("yaw", "0"))
        told = entry.licence, entry.creator
        rows.append(MeshRow(entry.key, category, use, yaw, entry.name, (x, y, z), "train", *told))
    return _split(rows)


def reviewed() -> dict[str, dict[str, str]]:
    """Corrections made by eye for the Sweet Home 3D libraries: key -> the columns that differ."""
    text = resources.files("echomodel.data").joinpath("mesh_review.json").read_text("utf-8")
    return json.loads(text)["models"]


def _split(rows: list[MeshRow]) -> list[MeshRow]:
    """Mark a fifth of every class as held out, those whose key hashes lowest."""
    members: dict[str, list[str]] = defaultdict(list)
    for row in rows:
        if row.use:
            members[row.category].append(row.key)
    held = set()
    for keys in members.values():
        keys.sort(key=lambda key: hashlib.sha256(key.encode()).hexdigest())
        held.update(keys[: round(HELD_OUT * len(keys))])
    return [replace(row, split="held_out" if row.key in held else "train") for row in rows]


def write_table(path: Path, rows: Iterable[MeshRow]) -> None:
    """Write the table as CSV; edit `class`, `use` (1 or 0) and `yaw` (degrees) and build again."""
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for r in rows:
            told = r.split, r.licence, r.creator
            writer.writerow([r.key, r.category, int(r.use), f"{r.yaw:g}", r.name, *r.size, *told])


def read_table(path: Path) -> list[MeshRow]:
    """Read a reviewed table; raises ValueError naming the file, the line and what is wrong there."""
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        missing = [name for name in COLUMNS if name not in (reader.fieldnames or ())]
        if missing:
            raise ValueError(f"{path}: misses the columns {', '.join(missing)}")
        rows = []
        for raw in reader:
            where = f"{path}, line {reader.line_num}"
            try:
                category = vocabulary().category(raw["class"]).name if raw["class"] else ""
                x, y, z = float(raw["width"]), float(raw["height"]), float(raw["depth"])
                yaw = float(raw["yaw"])
            except ValueError as error:
                raise ValueError(f"{where}: {error}") from None
            if raw["use"] not in ("0", "1") or raw["split"] not in ("train", "held_out"):
                found = f"use {raw['use']!r}, split {raw['split']!r}"
                raise ValueError(f"{where}: {found}; use is 0 or 1, split is train or held_out")
            use = raw["use"] == "1" and bool(category)
            told = raw["split"], raw["licence"], raw["creator"]
            rows.append(MeshRow(raw["key"], category, use, yaw, raw["name"], (x, y, z), *told))
    return rows


def prepared(entry: MeshEntry, row: MeshRow, loaders: Mapping[str, Loader] | None = None) -> trimesh.Trimesh:
    """The mesh of an entry as the table wants it: front to +Z, metres, standing on y = 0, centred."""
    mesh = load_mesh(entry, loaders)
    if row.yaw:
        mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.radians(row.yaw), [0, 1, 0]))
    return mesh


def build_meshes(
    directory: str | os.PathLike[str], entries: Sequence[MeshEntry], rows: Sequence[MeshRow], *, copies: int = 2,
    loaders: Mapping[str, Loader] | None = None, progress: StepListener | None = None,
    skipped: Callable[[str], None] | None = None,
) -> ShapeSet:  # fmt: skip
    """Turn the meshes that the table uses into a shape set with thumbnails and ATTRIBUTION.md.

    Arguments:
        directory: folder of the set.
        entries: the models on offer; rows: the reviewed table.
        copies: stored shapes per training mesh: itself, its mirror image, further ones alternating. The grid is
            normalised to the box, so that stretching shows in the size alone: copies have sizes stretched by about 8 %
            per axis. Held-out meshes are stored once, as they are.
        loaders: see `load_mesh`.
        progress: called with (meshes done, meshes in all).
        skipped: called with one line for every mesh that could not be used.

    Meshes that are done are kept in `parts/`, so that an interrupted build goes on where it stopped.
    """
    folder = Path(directory)
    (folder / "thumbnails").mkdir(parents=True, exist_ok=True)
    (folder / "parts").mkdir(exist_ok=True)
    by_key = {entry.key: entry for entry in entries}
    used = [row for row in rows if row.use and row.key in by_key]
    if not used:
        raise ValueError(f"{folder}: the table uses none of the {len(entries)} meshes")
    records, names, kept = [], [], []
    for done, row in enumerate(used, 1):
        try:
            tsdf, size = _one(folder, by_key[row.key], row, loaders)
        except ValueError as error:
            if skipped:
                skipped(str(error))
            continue
        finally:
            if progress:
                progress(done, len(used))
        kept.append(row)
        made = _copies(tsdf, size, row, copies)
        records += made
        names += [row.key] * len(made)
    for stale in folder.glob("shapes-*.bin"):
        stale.unlink()
    write_shard(folder / "shapes-0000.bin", records)
    write_text(folder / "ATTRIBUTION.md", attribution(kept))
    return finish_set(folder, {"kind": "meshes", "names": names}, len(records))


def _one(
    folder: Path, entry: MeshEntry, row: MeshRow, loaders: Mapping[str, Loader] | None
) -> tuple[np.ndarray, np.ndarray]:
    """TSDF and size of one mesh, from `parts/` where it was made before."""
    stem = re.sub(r"[^A-Za-z0-9]+", "-", row.key).strip("-")
    part = folder / "parts" / f"{stem}_{row.yaw:g}.npz"
    if part.exists():
        with np.load(part) as stored:
            return stored["tsdf"].astype(np.float32) / 127, stored["size"]
    mesh = prepared(entry, row, loaders)
    tsdf, size = tsdf_from_mesh(mesh), np.asarray(mesh.extents, float)
    write_picture(folder / "thumbnails" / f"{stem}.png", thumbnail(mesh))
    with whole_file(part) as beside, beside.open("wb") as file:
        np.savez_compressed(file, tsdf=np.rint(tsdf * 127).astype(np.int8), size=size)
    return np.rint(tsdf * 127).astype(np.float32) / 127, size


def _copies(tsdf: np.ndarray, size: np.ndarray, row: MeshRow, copies: int) -> list[ShapeRecord]:
    category, held = vocabulary().category_id(row.category), row.split == "held_out"
    seed = int.from_bytes(hashlib.sha256(row.key.encode()).digest()[:8], "big")
    rng = np.random.default_rng(seed)
    records = [ShapeRecord(tsdf, category, -1, size, held)]
    for number in range(1, 1 if held else copies):
        stretched = size * np.exp(rng.normal(0, 0.08, 3))
        records.append(ShapeRecord(tsdf[::-1] if number % 2 else tsdf, category, -1, stretched, False))
    return records


def attribution(rows: Sequence[MeshRow]) -> str:
    """Text of ATTRIBUTION.md: every model with its creator, grouped by licence."""
    lines = [
        "# Models used",
        "",
        "Converted to signed distance grids; names, creators and licences from their catalogues.",
    ]
    by_licence: dict[str, list[MeshRow]] = defaultdict(list)
    for row in rows:
        by_licence[row.licence].append(row)
    for licence in sorted(by_licence):
        lines += ["", f"## {licence}", "", "| model | name | creator |", "|---|---|---|"]
        lines += [f"| {r.key} | {r.name} | {r.creator} |" for r in sorted(by_licence[licence], key=lambda r: r.key)]
    return "\n".join(lines) + "\n"


PACKAGE = "sweethome3d-furniture"


def fetched_package(out: Path) -> Path:
    """Download the Debian package into OUT/source; raises ValueError where apt is missing or fails."""
    folder = out / "source"
    folder.mkdir(exist_ok=True)
    have = sorted(folder.glob(f"{PACKAGE}_*.deb"))
    if have:
        return have[-1]
    if shutil.which("apt-get") is None:
        raise ValueError(f"--debian needs apt-get; elsewhere download {PACKAGE}_1.8-1_all.deb and name it as a source")
    done = subprocess.run(["apt-get", "download", PACKAGE], cwd=folder, capture_output=True, text=True, check=False)
    found = sorted(folder.glob(f"{PACKAGE}_*.deb"))
    if done.returncode or not found:
        raise ValueError(f"apt-get download {PACKAGE} failed: {(done.stderr.strip() or 'no file').splitlines()[-1]}")
    return found[-1]


def entries_of(path: Path, out: Path, more: tuple[str, ...] = ()) -> list[MeshEntry]:
    """Models of one source: a library, a package of libraries, or a folder.

    Arguments:
        path: the source. out: where packages are unpacked.
        more: endings of files besides `MESH_FILES` that the caller can read.

    Raises ValueError for a source that is none.
    """
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if path.suffix == ".sh3f":
        return read_library(path)
    if path.suffix == ".deb":
        if shutil.which("dpkg") is None:
            raise ValueError(f"{path}: unpacking a Debian package needs dpkg; unpack it and name the .sh3f files")
        unpacked = out / "source" / path.stem
        if not unpacked.exists():
            unpacked.parent.mkdir(parents=True, exist_ok=True)
            done = subprocess.run(["dpkg", "-x", str(path), str(unpacked)], capture_output=True, text=True, check=False)
            if done.returncode:
                reason = (done.stderr.strip() or "no reason given").splitlines()[-1]
                raise ValueError(f"{path}: dpkg cannot unpack it ({reason})")
        path = unpacked
    if not path.is_dir():
        raise ValueError(f"{path}: not a .sh3f library, a .deb package or a folder")
    libraries = sorted(path.rglob("*.sh3f"))
    found = [entry for library in libraries for entry in read_library(library)]
    found = found or read_folder(path, (*MESH_FILES, *more))
    if not found:
        raise ValueError(f"{path}: holds neither .sh3f libraries nor {', '.join((*MESH_FILES, *more))} files")
    return found
