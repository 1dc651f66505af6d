"""Libraries of furniture: how long indexing and choosing take, and how often names and shapes tell class and front.

    OMP_NUM_THREADS=1 python benchmarks/assets.py FOLDER_OF_SWEETHOME3D_LIBRARIES [--rooms 20]

The folder is that of Debian's package sweethome3d-furniture, unpacked. Wanted: 1,000 models in 60 s on two cores (6
minutes with descriptors), 50 ms for a room from 10,000 rows; 90 % of the classes and of the fronts right. Class: by
name, group, size and shape, without the corrections by eye, against those corrections. Front: by shape alone, every
model turned by a random quarter, against the catalogue's front; only of classes that have one.
"""

from __future__ import annotations

import argparse
import random
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from echomodel.data.shapeset import held_out
from echomodel.loading import load_model
from echomodel.vocabulary import vocabulary
from echousd.assets.catalogues import entries_of
from echousd.assets.choose import Asked, AssetWishes, choose
from echousd.assets.describe import described, front_by_shape, named_by_shape
from echousd.assets.measure import measure
from echousd.assets.naming import category_of, fitted
from echousd.assets.record import AssetRecord
from echousd.assets.table import Library

FACED = ("seat", "sofa", "bed", "storage", "screen")


def indexing(entries: list, descriptors: bool) -> tuple[float, list[AssetRecord]]:
    """CPU seconds a model on one core, and the rows."""
    encoder = load_model(None) if descriptors else None
    started = time.process_time()
    found = [described(entry, Path("benchmark.parquet"), encoder=encoder) for entry in entries]
    return (time.process_time() - started) / len(found), found


def choosing(records: list[AssetRecord], rooms: int) -> float:
    """CPU seconds a room of twelve objects from 10,000 rows."""
    usable = [record for record in records if record.usable]
    many = {f"{i}": replace(usable[i % len(usable)], id=f"{i}") for i in range(10_000)}
    wishes = AssetWishes(Library(Path("benchmark.parquet"), many))
    wishes.shelves  # noqa: B018  # made once for a library
    draw = random.Random(0)
    took = []
    for seed in range(rooms):
        chosen = [draw.choice(usable) for _ in range(12)]
        asked = [Asked(f"o{i}", r.category, "room", r.dims) for i, r in enumerate(chosen)]
        started = time.process_time()
        choose(wishes, asked, seed)
        took.append(time.process_time() - started)
    return float(np.median(took[1:]))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rooms", type=int, default=20)
    parser.add_argument("--every", type=int, default=4, help="take every so-many-th model for the times")
    given = parser.parse_args()
    entries = entries_of(given.folder, print)
    for descriptors in (False, True):
        each, records = indexing(entries[:: given.every], descriptors)
        told = "with" if descriptors else "without"
        print(
            f"indexing {told} descriptors: {each * 1000:.0f} ms of a core each, two cores {each * 500:.0f} s for 1,000"
        )
    print(f"choosing for a room of 12 from 10,000 rows: {choosing(records, given.rooms) * 1000:.1f} ms")
    known = [entry for entry in entries if entry.decided and entry.category]
    held = held_out(known)
    for split in ("train", "held_out"):
        judged(entries, {one.key: one for one in known if (one.key in held) == (split == "held_out")}, split)


def judged(entries: list, held: dict, split: str) -> None:
    """Print how often class and front of some models are right."""
    right, wrong, turned = [], [], []
    draw = random.Random(0)
    for entry in entries:
        row = held.get(entry.key)
        if row is None or fitted(row.category, entry.name, entry.group):  # units of a kitchen are none of ours
            continue
        found, _ = category_of((), entry.name, entry.group, entry.dims)
        if found:
            found = named_by_shape(found, measure(entry.file).turned(np.asarray(entry.turn)), np.asarray(entry.dims))
        same = vocabulary().category(row.category).sgfront == (vocabulary().category(found).sgfront if found else "")
        (right if found == row.category else wrong).append((entry.key, row.category, found, same))
        if vocabulary().category(row.category).role not in FACED:
            continue
        mesh = measure(entry.file).turned(np.asarray(entry.turn))
        quarters = draw.randrange(4)
        quarter = np.linalg.matrix_power(np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), quarters)
        mesh.vertices = np.asarray(mesh.vertices) @ quarter.T
        back, evidence = front_by_shape(mesh, row.category)
        turned.append(((back + quarters) % 4 == 0, evidence, entry.key))
    print(f"class of {len(held)} models ({split}): {len(right) / max(len(held), 1):.1%} right")
    print("  others:", "; ".join(f"{key} {want} as {got or 'nothing'}" for key, want, got, _ in wrong))
    print(f"front of {len(turned)} models ({split}) by shape alone: {np.mean([t[0] for t in turned]):.1%} right")
    print("  others:", "; ".join(f"{key} ({evidence:.2f})" for good, evidence, key in turned if not good))


if __name__ == "__main__":
    main()
