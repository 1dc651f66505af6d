"""Damaged files of everything but rooms: indices, models, stores, batches, data, checkpoints, jobs, archives, journals.

    OMP_NUM_THREADS=1 nice -n 5 python benchmarks/flipped_others.py --flips 100

As `flipped_files.py`: a command works, or ends in one line that names a file or prim, in a process of its own.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch

from echomodel.loading import load_model
from echousd.cli.main import run

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/strategies"))
from flips import KINDS, Flip, end_of, flipped

ROOT = Path(__file__).parents[1]
GRAPH = ROOT / "samples/bedroom.yaml"
QUICK = ("--shapes", "boxes", "--dress", "none", "--drafts", "1")
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
            if run([word.replace("{top}", str(top)) for word in words]) not in (0, 1):
                raise SystemExit(f"echousd {' '.join(words)} failed")

    return make


def interrupted(top: Path) -> None:
    """A room whose last run was killed when its journal was there."""
    from echousd.folder.journal import STAGING, Journal, Move, digest, digest_of, write_journal

    ran(("generate", str(GRAPH), "-o", "{top}/room", *QUICK))(top)
    staging = top / "room" / STAGING
    staging.mkdir()
    (staging / "0").write_bytes(b"#usda 1.0\n")
    to = "layers/layout.usda"
    move = Move(staged="0", to=to, digest=digest(b"#usda 1.0\n"), over=digest_of(top / "room" / to))
    write_journal(staging, Journal(move=[move], remove=[]))


def models(top: Path) -> None:
    """A library of a model in each format."""
    import trimesh

    ran(("generate", str(GRAPH), "-o", "{top}/made", "--no-walls", "--dress", "none"))(top)
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
        ran(("generate", str(GRAPH), "-o", "{top}/room"), ("export", "{top}/room/room.usda", "-o", "{top}/room.usdz")),
    ),
    "library": Case(
        ("library*", "models/**/*"),
        (
            ("generate", str(GRAPH), "-o", "{top}/room", "--shapes", "library", "--assets", "{top}/library.parquet"),
            ("assets", "review", "{top}/library.parquet"),
            ("assets", "index", "{top}/models", "-o", "{top}/again.parquet", "--workers", "1"),
        ),
        models,
    ),
    "store": Case(
        ("store/**/*",),
        (("store", "verify", "{top}/store"), ("store", "gc", "{top}/store", "{top}/room"), ("check", "{top}/room")),
        ran(("generate", str(GRAPH), "-o", "{top}/room", "--store", "{top}/store")),
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
            ("data", "sheet", "{top}/data/shapes", "-o", "{top}/o.png"),
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
            ("generate", str(GRAPH), "-o", "{top}/room", "--no-walls", "--dress", "none"),
            ("texture", "export", "{top}/room/room.usda", "-o", "{top}/job", "--for", "generic", "--resolution", "64"),
        ),
    ),
    "undo": Case(
        ("room/**/*.zip", "room/room.json"),
        (("edit", "{top}/room", "--undo"),),
        ran(
            ("generate", str(GRAPH), "-o", "{top}/room", *QUICK),
            ("edit", "{top}/room", "--add", "fern:plant", "--shapes", "boxes"),
        ),
    ),
    "interrupted": Case(
        ("room/.echousd/*",),
        (("edit", "{top}/room", "--lock", "bed"), ("generate", str(GRAPH), "-o", "{top}/room", *QUICK)),
        interrupted,
    ),
}  # fmt: skip


def main() -> None:
    """Print every fault and how many flips were tried by kind of file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flips", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=CASES, nargs="*", default=list(CASES))
    asked = parser.parse_args()
    torch.set_num_threads(1)  # threads do not survive a fork
    load_model(None)
    draw, tried, wrong = random.Random(asked.seed), Counter[str](), 0
    with tempfile.TemporaryDirectory(prefix="echousd-flips-") as place:
        scratch = Path(place)
        for number in range(asked.flips):
            name = asked.only[number % len(asked.only)]
            case, top = CASES[name], scratch / name
            if not top.exists():
                top.mkdir()
                case.make(top)
            files = sorted(path for mask in case.files for path in top.glob(mask) if path.is_file())
            flip = Flip(str(draw.choice(files).relative_to(top)), draw.choice(KINDS), number)
            kept = (top / flip.path).read_bytes()
            mutant = scratch / f"{name}{number}"
            shutil.copytree(top, mutant)
            (top / flip.path).write_bytes(flipped(kept, flip))
            words = [w.replace("{file}", str(top / flip.path)) for w in draw.choice(case.commands)]
            words = [w.replace("{top}", str(top)) for w in words]
            found = end_of(words, scratch)
            shutil.rmtree(top)
            mutant.rename(top)
            tried[f"{name} {Path(flip.path).suffix}"] += 1
            if found:
                wrong += 1
                print(f"echousd {' '.join(words)} with {flip}: {found}", flush=True)
    told = ", ".join(f"{count} of {ending}" for ending, count in tried.most_common())
    print(f"{asked.flips} damaged files ({told}): {wrong} faults")


if __name__ == "__main__":
    main()
