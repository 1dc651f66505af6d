"""Damaged files of everything but rooms: indices, models, stores, batches, data, checkpoints, jobs, archives, journals.

A command works, or ends in one line that names a file or prim, in a process of its own. The gate draws a few damages
of what is quickly made; `ECHOUSD_MUTATIONS=100` draws so many of each kind.
"""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import torch
from flips import KINDS, Flip, end_of, flipped
from small_room import StandIn, small_graph

from echousd.cli.main import run

MANY = int(os.environ.get("ECHOUSD_MUTATIONS", "0").replace("all", "100"))
ROOT = Path(__file__).parents[3]
GRAPH = ROOT / "samples/bedroom.yaml"
QUICK = ("--shapes", "boxes", "--dress", "none", "--drafts", "1", "--no-place")
MADE = ("generate", "{top}/graph.json", "-o", "{top}/room", *QUICK)
TRAIN = (
    "train", f"{ROOT}/model/recipes/latent.toml", "--set", "data={top}/data", "--set", "nodes=24", "--set", "steps={n}",
    "--set", "save_every=1", "-o", "{top}/run",
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """Commands that read some files; `{top}` stands for the folder that holds them.

    Arguments:
        files: patterns below the folder. commands: of these one is run. make: what is run before, once.
    """

    files: tuple[str, ...]
    commands: tuple[tuple[str, ...], ...]
    make: Callable[[Path], object]


def ran(*commands: tuple[str, ...]) -> Callable[[Path], object]:
    """Commands that make a folder."""

    def make(top: Path) -> None:
        for words in commands:
            assert run([word.replace("{top}", str(top)) for word in words]) in (0, 1), words

    return make


def interrupted(top: Path) -> None:
    """A room whose last run was killed when its journal was there."""
    from echomodel.files import digest
    from echousd.folder.journal import Journal, Move, digest_of, write_journal
    from echousd.pending import STAGING

    ran(MADE)(top)
    staging = top / "room" / STAGING
    staging.mkdir()
    (staging / "0").write_bytes(b"#usda 1.0\n")
    to = "layers/layout.usda"
    move = Move(staged="0", to=to, digest=digest(b"#usda 1.0\n"), over=digest_of(top / "room" / to))
    write_journal(staging, Journal(move=[move], remove=[]))


def models(top: Path) -> None:
    """A library of a model in each format."""
    import trimesh

    ran(("generate", "{top}/graph.json", "-o", "{top}/made", *QUICK))(top)
    shutil.copytree(top / "made/assets", top / "models")
    shutil.rmtree(top / "made")
    box = trimesh.creation.box((1.8, 0.5, 2.0))
    box.export(top / "models/double_bed.glb")
    box.export(top / "models/wardrobe.obj")
    ran(("assets", "index", "{top}/models", "-o", "{top}/library.parquet", "--workers", "1"))(top)
    ran(("assets", "review", "{top}/library.parquet"))(top)


def sources(top: Path) -> None:
    """Graphs of a batch as lines and as a table, and a request."""
    import pyarrow as pa
    import pyarrow.parquet as parquet

    from echousd.graph import load_graph

    texts = [load_graph(GRAPH).to_json()] * 2
    (top / "graphs.jsonl").write_text("".join(json.dumps({"graph": json.loads(text)}) + "\n" for text in texts))
    parquet.write_table(pa.table({"graph": texts}), top / "graphs.parquet")
    (top / "batch.toml").write_text(f'sources = ["{GRAPH}"]\ncount = 2\noptions = {{ shapes = "boxes" }}\n')


ROOMS = ("batch", "run", str(GRAPH), "-o", "{top}/run", "--count", "2", "--workers", "1", "--no-preview", *QUICK)
CASES = {
    "usdz": Case(
        ("room.usdz",),
        (
            ("check", "{top}/room.usdz"),
            ("graph", "{top}/room.usdz"),
            ("export", "{top}/room.usdz", "-o", "{top}/o.glb"),
        ),
        ran(MADE, ("export", "{top}/room/room.usda", "-o", "{top}/room.usdz")),
    ),
    "library": Case(
        ("library*", "models/**/*"),
        (
            (*MADE[:4], "--shapes", "library", "--assets", "{top}/library.parquet"),
            ("assets", "review", "{top}/library.parquet"),
            ("assets", "index", "{top}/models", "-o", "{top}/again.parquet", "--workers", "1"),
        ),
        models,
    ),
    "store": Case(
        ("store/**/*",),
        (("store", "verify", "{top}/store"), ("store", "gc", "{top}/store", "{top}/room"), ("check", "{top}/room")),
        ran((*MADE, "--store", "{top}/store")),
    ),
    "batch": Case(
        ("run/**/*",),
        (("batch", "status", "{top}/run"), ("batch", "verify", "{top}/run"), (*ROOMS, "--resume")),
        ran(ROOMS),
    ),
    "sources": Case(
        ("*.jsonl", "*.parquet", "*.toml"),
        (("batch", "run", "{file}", "-o", "{top}/run", "--workers", "1", *QUICK),),
        sources,
    ),
    "data": Case(
        ("data/**/*",),
        (
            ("data", "plot", "{top}/data/rooms", "-o", "{top}/o.png"),
            tuple(word.replace("{n}", "2") for word in TRAIN),
        ),
        ran(("data", "build", "--recipe", "smoke", "-o", "{top}/data")),
    ),
    "checkpoint": Case(
        ("run/**/*",),
        (tuple(word.replace("{n}", "3") for word in (*TRAIN, "--resume")),),
        ran(
            ("data", "build", "--recipe", "smoke", "-o", "{top}/data"),
            tuple(word.replace("{n}", "2") for word in TRAIN),
        ),
    ),
    "texture": Case(
        ("job/**/*",),
        (("texture", "import", "{top}/room/room.usda", "{top}/job", "--name", "oil"),),
        ran(
            MADE,
            ("texture", "export", "{top}/room/room.usda", "-o", "{top}/job", "--for", "generic", "--resolution", "64"),
        ),
    ),
    "undo": Case(
        ("room/**/*.zip", "room/room.json"),
        (("edit", "{top}/room", "--undo"),),
        ran(
            MADE,
            ("edit", "{top}/room", "--remove", "pendant", "--shapes", "boxes", "--no-place"),
        ),
    ),
    "interrupted": Case(
        ("room/.echousd/*",),
        (("edit", "{top}/room", "--lock", "bed"), MADE),
        interrupted,
    ),
}  # fmt: skip


FEW = ("store", "undo")


@pytest.mark.parametrize("name", CASES)
def test_the_file_is_named(name, tmp_path, monkeypatch):
    if not MANY and name not in FEW:
        pytest.skip("minutes: ECHOUSD_MUTATIONS=100")
    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    monkeypatch.setattr("echousd.make.save.PREVIEW", 16)
    torch.set_num_threads(1)  # threads do not survive a fork
    case, top, faults = CASES[name], tmp_path / "top", []
    top.mkdir()
    (top / "graph.json").write_text(small_graph().to_json())
    case.make(top)
    for number in range(MANY or 2):
        draw = random.Random(f"{name} {number}")
        files = sorted(path for mask in case.files for path in top.glob(mask) if path.is_file())
        flip = Flip(str(draw.choice(files).relative_to(top)), draw.choice(KINDS), number)
        shutil.copytree(top, tmp_path / "kept")  # the command is run where the files were made: they may name it
        (top / flip.path).write_bytes(flipped((top / flip.path).read_bytes(), flip))
        words = [word.replace("{file}", str(top / flip.path)) for word in draw.choice(case.commands)]
        found = end_of([word.replace("{top}", str(top)) for word in words], tmp_path)
        faults += [f"echousd {' '.join(words)} with {flip}: {found}"] if found else []
        shutil.rmtree(top)
        (tmp_path / "kept").rename(top)
    assert not faults, "\n".join(faults)
