"""Sets of shapes on disk: sharded, memory-mapped, 4-bit TSDFs under zstd, a few kilobytes a shape.

A folder holds `shapes.json` (what the set is, written last) and shards `shapes-0000.bin`: a header, one fixed-size
entry per shape, then the compressed grids. Shape number `style * C + category` of a parametric set is the piece of that
category in that style, C being the number of categories; rooms name it `s{style}_{category}`.
"""

import hashlib
import os
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
import zstandard

from echomodel.data.roomset import RoomSet, build_rooms, claim, kept_out, set_note
from echomodel.files import check_ours, whole_file, write_json, write_text
from echomodel.furniture import Style, draw_choices, draw_style, sample_size, solids
from echomodel.furniture.solids import Solid
from echomodel.progress import StageListener, StepListener
from echomodel.rooms.generator import STYLES
from echomodel.tsdf import RESOLUTION, TRUNCATION, tsdf_from_mesh, tsdf_of
from echomodel.vocabulary import vocabulary

# Magnitudes of the 16 levels in voxels: finest about the surface, where the zero crossing is read off.
MAGNITUDES = np.array([0.12, 0.38, 0.68, 1.05, 1.5, 2.1, 2.95, 4.0])
LEVELS = (np.concatenate([-MAGNITUDES[::-1], MAGNITUDES]) / TRUNCATION).astype(np.float32)
EDGES = (LEVELS[1:] + LEVELS[:-1]) / 2
MAGIC = b"ECHOSHP1"
ENTRY = np.dtype(
    [
    ("offset", "<u8"), ("length", "<u4"), ("category", "<i4"), ("style", "<i4"), ("held_out", "<i4"),
    ("size", "<f4", 3),
    ]
)  # fmt: skip
STYLES_PER_SHARD = 8
COMPRESSION = 12


@dataclass(frozen=True, eq=False)
class ShapeRecord:
    """One shape to store: its TSDF (64, 64, 64), category id, style (or -1), size (3,) in metres, and its split."""

    tsdf: np.ndarray
    category: int
    style: int
    size: np.ndarray
    held_out: bool


def piece(seed: int, style: int, category: str) -> tuple[Style, np.ndarray, list[Solid]]:
    """The piece of `category` in style number `style` of the world with this seed: its style, size (3,) and solids."""
    position = vocabulary().category_id(category)
    look = draw_style(np.random.default_rng([seed, style]))
    rng = np.random.default_rng([seed, style, position])
    size = sample_size(category, rng, look)
    return look, size, solids(category, look, draw_choices(rng), size)


def quantised(tsdf: np.ndarray) -> np.ndarray:
    """TSDF values in [-1, 1] -> level numbers 0..15, uint8."""
    return np.searchsorted(EDGES, tsdf).astype(np.uint8)


def build_shapes(
    directory: str | os.PathLike[str], styles: int, seed: int, progress: StepListener | None = None
) -> "ShapeSet":
    """Make all categories in `styles` styles, shard by shard; the same bytes for the same seed, whenever interrupted.

    Arguments:
        directory: folder of the set; shards that are complete there are kept.
        styles: number of styles, at least 1.
        seed: seed of the world.
        progress: called with (shapes done, shapes in all) after each style.

    Raises ValueError where the folder holds a set with another seed or number of styles.
    """
    if styles < 1:
        raise ValueError(f"number of styles is {styles}, need at least 1")
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    names = [category.name for category in vocabulary().categories]
    plan = {"kind": "parametric", "seed": seed, "styles": styles, "categories": names}
    claim(folder, plan)
    total = styles * len(names)
    for number, first in enumerate(range(0, styles, STYLES_PER_SHARD)):
        chunk = range(first, min(first + STYLES_PER_SHARD, styles))
        path = folder / f"shapes-{number:04d}.bin"
        if not path.exists():
            write_shard(path, _records(chunk, names, seed, lambda done: progress and progress(done, total)))
        elif progress:
            progress(chunk[-1] * len(names) + len(names), total)
    return finish_set(folder, plan, total)


def finish_set(folder: Path, info: dict, count: int) -> "ShapeSet":
    """Write `shapes.json`, which makes the shards of a folder a set, and open it."""
    categories = [category.name for category in vocabulary().categories]
    grid = {"resolution": RESOLUTION, "truncation": TRUNCATION}
    write_json(folder / "shapes.json", {"categories": categories, **info, "count": count, **grid})
    return ShapeSet(folder)


def _records(styles: range, names: list[str], seed: int, done: Callable[[int], object]) -> Iterable[ShapeRecord]:
    for style in styles:
        for category, name in enumerate(names):
            _, size, parts = piece(seed, style, name)
            yield ShapeRecord(tsdf_of(parts), category, style, size, kept_out(style))
        done((style + 1) * len(names))


def write_shard(path: str | os.PathLike[str], records: Iterable[ShapeRecord]) -> None:
    """Write one shard, complete or not at all."""
    path = Path(path)
    compressor = zstandard.ZstdCompressor(level=COMPRESSION, write_content_size=True)
    blobs, entries, offset = [], [], 0
    for record in records:
        blob = compressor.compress(quantised(record.tsdf).tobytes())
        entries.append((offset, len(blob), record.category, record.style, int(record.held_out), tuple(record.size)))
        blobs.append(blob)
        offset += len(blob)
    table = np.array(entries, ENTRY)
    with whole_file(path) as beside, beside.open("wb") as file:
        file.write(MAGIC + np.array([len(table)], "<u8").tobytes() + table.tobytes())
        file.writelines(blobs)


class ShapeSet:
    """A set of shapes on disk, read shape by shape through memory maps.

    `directory`: folder with `shapes.json` and its shards.

    Attributes: `category` (n,) int class ids, `style` (n,) int, `size` (n, 3) float32 metres, `held_out` (n,) bool and
    `info`, the content of `shapes.json`. Raises ValueError for a folder without a finished set or with a damaged shard.
    """

    def __init__(self, directory: str | os.PathLike[str]):
        self.directory = Path(directory)
        self.info: dict = set_note(self.directory, "shape", count=int, categories=list)
        self.categories: tuple[str, ...] = tuple(self.info["categories"])
        paths = sorted(self.directory.glob("shapes-*.bin"))
        self._shards = [np.memmap(path, np.uint8, mode="r") for path in paths]
        tables = [_table(path, shard) for path, shard in zip(paths, self._shards, strict=True)]
        count = sum(len(table) for table in tables)
        if count != self.info["count"]:
            raise ValueError(f"{self.directory}: shards hold {count} shapes, shapes.json says {self.info['count']}")
        self._table = np.concatenate(tables)
        self._shard_of = np.repeat(np.arange(len(tables)), [len(table) for table in tables])
        self._begin = [len(MAGIC) + 8 + table.nbytes for table in tables]
        self._decompressor = zstandard.ZstdDecompressor()
        self.category = self._table["category"].astype(np.int64)
        self.style = self._table["style"].astype(np.int64)
        self.size = self._table["size"].copy()
        self.held_out = self._table["held_out"].astype(bool)

    def __len__(self) -> int:
        return len(self._table)

    def codes(self, index: int) -> np.ndarray:
        """Level numbers (64, 64, 64) uint8 of one shape; `LEVELS[codes]` is its TSDF."""
        entry, shard = self._table[index], int(self._shard_of[index])
        start = self._begin[shard] + int(entry["offset"])
        raw = self._decompressor.decompress(self._shards[shard][start : start + int(entry["length"])].data)
        return np.frombuffer(raw, np.uint8).reshape((RESOLUTION,) * 3)

    def __getitem__(self, index: int) -> np.ndarray:
        """TSDF (64, 64, 64) float32 of one shape."""
        return LEVELS.take(self.codes(index))

    def tsdf(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """TSDFs (n, 64, 64, 64) float32 of several shapes."""
        return LEVELS.take(np.stack([self.codes(int(i)) for i in indices]))

    def index_of(self, name: str) -> int:
        """Shape number of a model name `s{style}_{category}` of a parametric set; raises ValueError."""
        style, _, category = name.removeprefix("s").partition("_")
        if not name.startswith("s") or not style.isdigit() or category not in self.categories:
            raise ValueError(f"model {name!r} is not a shape of this set, names are s<style>_<category>")
        index = int(style) * len(self.categories) + self.categories.index(category)
        if index >= len(self):
            raise ValueError(f"model {name!r}: the set has styles 0 to {len(self) // len(self.categories) - 1}")
        return index


def _table(path: Path, shard: np.ndarray) -> np.ndarray:
    if bytes(shard[:8]) != MAGIC:
        raise ValueError(f"{path}: not a shard of shapes (begins with {bytes(shard[:8])!r}, expected {MAGIC!r})")
    count = int(np.frombuffer(shard[8:16].tobytes(), "<u8")[0])
    end = 16 + count * ENTRY.itemsize
    table = np.frombuffer(shard[16:end].tobytes(), ENTRY)
    need = end + int(table["length"].sum())
    if len(shard) != need:
        raise ValueError(f"{path}: damaged shard, {len(shard)} bytes of {need}; remove it and build again")
    return table


HELD_OUT = 0.2


@dataclass(frozen=True, eq=False)
class MeshModel:
    """A model to learn from.

    Arguments:
        key: unique in the set. category: of the vocabulary. name, licence, author: for the attribution.
        version: another word where `load` gives another mesh than before.
        load: its surface in the object frame, metres; raises ValueError that names its file.
    """

    key: str
    category: str
    name: str
    licence: str
    author: str
    version: str
    load: Callable[[], trimesh.Trimesh]


def build_meshes(
    directory: str | os.PathLike[str], models: Sequence[MeshModel], *, copies: int = 2,
    progress: StepListener | None = None, skipped: Callable[[str], None] | None = None,
) -> ShapeSet:  # fmt: skip
    """Turn models into a shape set with ATTRIBUTION.md; a fifth of each class, by the hash of its key, is held out.

    Arguments:
        directory: folder of the set.
        copies: stored shapes per training mesh: itself, its mirror image, further ones alternating. The grid is
            normalised to the box, so that stretching shows in the size alone: copies have sizes stretched by about 8 %
            per axis. Held-out meshes are stored once, as they are.
        progress: called with (meshes done, meshes in all).
        skipped: called with one line for every mesh that could not be used.

    Meshes that are done are kept in `parts/`, so that an interrupted build goes on where it stopped.
    """
    folder = Path(directory)
    if not models:
        raise ValueError(f"{folder}: no model to learn from, allowed: a library with usable models")
    check_ours(folder, "data set", "parts")
    (folder / "parts").mkdir(parents=True, exist_ok=True)
    records, names, kept, held = [], [], [], held_out(models)
    for done, model in enumerate(models, 1):
        try:
            tsdf, size = _distances(folder, model)
        except ValueError as error:
            if skipped:
                skipped(str(error))
            continue
        finally:
            if progress:
                progress(done, len(models))
        kept.append(model)
        made = _copies(tsdf, size, model, 1 if model.key in held else copies, model.key in held)
        records += made
        names += [model.key] * len(made)
    for stale in folder.glob("shapes-*.bin"):
        stale.unlink()
    write_shard(folder / "shapes-0000.bin", records)
    write_text(folder / "ATTRIBUTION.md", attribution(kept))
    return finish_set(folder, {"kind": "meshes", "names": names}, len(records))


def held_out(models: Sequence[MeshModel]) -> frozenset[str]:
    """The keys of a fifth of every class, those that hash lowest."""
    members: dict[str, list[str]] = defaultdict(list)
    for model in models:
        members[model.category].append(model.key)
    ranked = (sorted(keys, key=lambda key: hashlib.sha256(key.encode()).hexdigest()) for keys in members.values())
    return frozenset(key for keys in ranked for key in keys[: round(HELD_OUT * len(keys))])


def _distances(folder: Path, model: MeshModel) -> tuple[np.ndarray, np.ndarray]:
    """TSDF and size of one mesh, from `parts/` where it was made before."""
    version = hashlib.sha256(f"{model.key} {model.version}".encode()).hexdigest()[:16]
    part = folder / "parts" / f"{re.sub(r'[^A-Za-z0-9]+', '-', model.key).strip('-')[:60]}_{version}.npz"
    if not part.exists():
        mesh = model.load()
        mesh.update_faces(mesh.area_faces > 0)
        tsdf, size = tsdf_from_mesh(mesh), np.asarray(mesh.extents, float)
        with whole_file(part) as beside, beside.open("wb") as file:
            np.savez_compressed(file, tsdf=np.rint(tsdf * 127).astype(np.int8), size=size)
    with np.load(part) as stored:
        return stored["tsdf"].astype(np.float32) / 127, stored["size"]


def _copies(tsdf: np.ndarray, size: np.ndarray, model: MeshModel, copies: int, held: bool) -> list[ShapeRecord]:
    category = vocabulary().category_id(model.category)
    rng = np.random.default_rng(int.from_bytes(hashlib.sha256(model.key.encode()).digest()[:8], "big"))
    records = [ShapeRecord(tsdf, category, -1, size, held)]
    for number in range(1, copies):
        stretched = size * np.exp(rng.normal(0, 0.08, 3))
        records.append(ShapeRecord(tsdf[::-1] if number % 2 else tsdf, category, -1, stretched, False))
    return records


def attribution(models: Sequence[MeshModel]) -> str:
    """Text of ATTRIBUTION.md: every model with its author, grouped by licence."""
    lines = ["# Models used", "", "Converted to signed distance grids; names, authors and licences from their library."]
    by_licence: dict[str, list[MeshModel]] = defaultdict(list)
    for model in sorted(models, key=lambda model: (model.licence, model.key)):
        by_licence[model.licence].append(model)
    for licence, members in by_licence.items():
        lines += ["", f"## {licence}", "", "| model | name | author |", "|---|---|---|"]
        lines += [f"| {m.key} | {m.name} | {m.author} |" for m in members]
    return "\n".join(lines) + "\n"


# labelled rooms, styles in which the set has all categories, and the share of the rooms that are halls
RECIPES = {"smoke": (64, 2, 0.0), "packed": (12_000, 160, 0.0), "full": (30_000, STYLES, 0.12)}


def build_data(
    directory: str | os.PathLike[str], recipe: str, seed: int, progress: StageListener | None = None
) -> tuple[RoomSet, ShapeSet]:
    """Make `directory/rooms` and `directory/shapes`; a build that was stopped continues, a finished one is kept.

    Arguments:
        directory: folder of the data set.
        recipe: `smoke` (seconds, for tests), `packed` (at most 40 MB) or `full`.
        seed: seed of the world: equal seeds give equal bytes.
        progress: called with (part, done, in all).

    Raises ValueError for an unknown recipe, or a folder that was begun with another recipe or seed.
    """
    if recipe not in RECIPES:
        raise ValueError(f"unknown recipe {recipe!r}: allowed are {', '.join(RECIPES)}")
    (count, styles, halls), folder = RECIPES[recipe], Path(directory)

    check_ours(folder, "data set", "data.json", "rooms/plan.json")

    def report(part: str) -> StepListener | None:
        return None if progress is None else lambda done, total: progress(part, done, total)

    rooms = build_rooms(folder / "rooms", count, seed, styles, report("rooms"), halls=halls)
    shapes = build_shapes(folder / "shapes", styles, seed, report("shapes"))
    note = {"recipe": recipe, "seed": seed, "rooms": len(rooms), "shapes": len(shapes), "styles": styles}
    write_json(folder / "data.json", note)
    return rooms, shapes
