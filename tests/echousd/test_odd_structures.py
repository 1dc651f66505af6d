"""Files of ours with one or a few parts of their structure wrong: a line and exit code 2 or 1, never a fault of ours.

Each case is drawn from its number alone. The gate takes a few of each kind; `ECHOUSD_MUTATIONS=600` takes so many.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import sys
from copy import deepcopy
from dataclasses import fields, replace
from pathlib import Path

import pytest
import yaml
from inline_batches import QUICK, Inline, batch
from small_models import chest, write_obj
from small_room import StandIn, small_graph

from echousd.assets.index import index
from echousd.assets.model_file import ModelFile
from echousd.assets.table import read_library, write_library
from echousd.batches.verify import finish
from echousd.shapes.originals.loading import converted

MANY = int(os.environ.get("ECHOUSD_MUTATIONS", "0").replace("all", "600")) or 12
LEAVES = (
    None, True, 0, -1, 1, 2**70, -(2**63), 1e308, -1e308, 5e-324, float("nan"), float("inf"), "", "\0", "\ud800",
    "x" * 70_000, "é" * 300, "../../x", "/etc/passwd", "a/" * 2000, "file:///etc", "bed", "left", [], {}, [[]], [None],
    {"": None}, ["a"] * 2000,
)  # fmt: skip


def deep(value, times):
    for number in range(times):
        value = [value] if number % 2 else {"a": value}
    return value


def places(value, at=()):
    """Paths of all parts of plain data, the whole included."""
    yield at
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in inner:
        yield from places(part, (*at, key))


def mutated(value, rng):
    """Plain data with one part taken out, doubled, exchanged for another of its parts, wrapped, renamed or replaced."""
    value = deepcopy(value)
    found = list(places(value))
    if len(found) == 1:
        return rng.choice(LEAVES)
    *way, last = rng.choice(found[1:])
    parent = value
    for key in way:
        parent = parent[key]
    part, other = deepcopy(parent[last]), value
    for key in rng.choice(found):
        other = other[key]
    kind = rng.randrange(7)
    if kind == 0:
        del parent[last]
    elif kind == 1 and isinstance(parent, list):
        parent[last:last] = [part] * rng.choice((1, 2, 50))
    elif kind == 2:
        parent[last] = deepcopy(other)
    elif kind == 3:
        parent[last] = deep(part, rng.choice((1, 2, 150)))
    elif kind == 4 and isinstance(parent, dict):
        parent[rng.choice(["", "\ud800", "name", "\0", "x" * 300])] = parent.pop(last)
    else:
        parent[last] = deepcopy(rng.choice(LEAVES))
    return value if rng.random() < 0.7 else mutated(value, rng)


def dumped(value):
    return json.dumps(value, ensure_ascii=False).encode("utf-8", "surrogatepass")


def fine(done, path):
    """What a command may do with a file that is wrong: go on, or say so in lines that name it."""
    assert done.code in (0, 1, 2), done.err
    assert done.code != 2 or str(path) in done.err, done.err


def said(call, first, **rest):
    """What a function says of a file that is wrong, or its first argument where it has nothing to say."""
    try:
        call(first, **rest)
    except ValueError as error:
        return str(error)
    return str(first)


@pytest.mark.parametrize("form", ["json", "yaml"])
def test_graphs(form, tmp_path, echousd_command):
    plain = json.loads(small_graph().to_json())
    path = tmp_path / f"graph.{form}"
    for number in range(MANY):
        rng = random.Random(f"graph {form} {number}")
        wrong = mutated(plain, rng)
        if form == "json":
            path.write_bytes(dumped(wrong))
        else:
            try:
                text = yaml.safe_dump(wrong, allow_unicode=rng.random() < 0.5)
            except RecursionError:
                text = "[" * 900
            lines = text.splitlines(keepends=True)
            if rng.random() < 0.5:
                at = rng.randrange(len(lines))
                lines[at] = (
                    rng.choice(("&a ", "*a\n", "  ", "- ", "<<: *a\n", "!!python/object:os.system ", "\t")) + lines[at]
                )
            path.write_bytes("".join(lines).encode("utf-8", "surrogatepass"))
        fine(echousd_command("graph", path), path)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    top = tmp_path_factory.mktemp("structures")
    graph = {"room": {"type": "bedroom"}, "nodes": [{"name": "desk", "category": "desk"}]}
    (top / "graphs.jsonl").write_text(json.dumps(graph) + "\n")
    assert batch(top / "graphs.jsonl", top / "run", executor=Inline(), **QUICK).complete
    return top / "run"


@pytest.mark.parametrize("name", ["plan.jsonl", "graphs.jsonl", "shard_0_of_1/journal.jsonl"])
def test_runs(made, name, tmp_path, echousd_command):
    run = tmp_path / "run"
    shutil.copytree(made, run)
    lines = (made / ".batch" / name).read_text().splitlines()
    for number in range(MANY):
        rng = random.Random(f"{name} {number}")
        at = rng.randrange(len(lines))
        wrong = [*(line.encode() for line in lines[:at]), dumped(mutated(json.loads(lines[at]), rng))]
        wrong += [line.encode() for line in lines[at + rng.choice((0, 1, 1, 1)) :]]
        (run / ".batch" / name).write_bytes(b"\n".join(wrong) + rng.choice((b"\n", b"", b"\n{", b"\n\xff\n")))
        fine(echousd_command("batch", "status", run, *(["--json"] if number % 2 else [])), run)
        fine(echousd_command("batch", "verify", run), run)
        assert str(run) in said(finish, run, webdataset=number % 5 == 0)


TOKENS = (
    "f", "v", "vt", "vn", "usemtl", "mtllib", "1", "-1", "0", "1//1", "1/2/3", "99999999999999999999", "1e400", "nan",
    "inf", "x", "", "\\", "#", "\0", "\u2028", "\ud7ff", "../../../etc/passwd", "/etc/passwd", "map_Kd",
    "o", "l", "1 " * 3000,
)  # fmt: skip


def test_meshes(tmp_path):
    (tmp_path / "models").mkdir()
    path = write_obj(tmp_path / "models", "wardrobe", chest(1.0, 2.0, 0.5))
    library = path.with_suffix(".mtl")
    texts = {path: path.read_text(), library: library.read_text()}
    for number in range(MANY):
        rng = random.Random(f"obj {number}")
        for file, text in texts.items():
            lines = text.splitlines()
            for _ in range(rng.choice((1, 2, 5))):
                at = rng.randrange(len(lines))
                words = lines[at].split(" ")
                words[rng.randrange(len(words))] = rng.choice(TOKENS)
                lines[at : at + rng.choice((0, 1, 1))] = [" ".join(words)] * rng.choice((1, 1, 3))
            file.write_text("\n".join(lines), "utf-8")
        (tmp_path / "lib.parquet").unlink(missing_ok=True)
        done = index([tmp_path / "models"], tmp_path / "lib.parquet")
        assert (done.models, len(done.faults)) in ((1, 0), (1, 1))
        assert all(str(path) in fault for fault in done.faults)
        assert str(path) in said(converted, ModelFile(path, path.parent))


NUMBERS = (0.0, -1.0, 1e-300, 1e308, float("nan"), float("inf"), 0.5)
TEXTS = (
    "",
    "\0",
    "x" * 5000,
    "../..",
    "/",
    "/etc/passwd",
    "a.sh3f!b.obj",
    "no.obj",
    "chair",
    "<b>&",
    "é\n\t",
    "a/" * 2000,
)


def odd(value, rng):
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return rng.choice((-1, 0, 2**62))
    if isinstance(value, float):
        return rng.choice(NUMBERS)
    if isinstance(value, bytes):
        return rng.choice((b"", b"\x89PNG", b"x" * 100))
    if isinstance(value, str):
        return rng.choice(TEXTS)
    kept = list(value)[: rng.choice((0, 1, len(value)))]
    return tuple(kept + [rng.choice(NUMBERS if kept and isinstance(kept[0], float) else TEXTS)] * rng.choice((0, 1, 9)))


def test_indices(tmp_path, echousd_command, monkeypatch):
    monkeypatch.setattr("echousd.make.layouts.load_model", lambda *_, **__: StandIn())
    monkeypatch.setattr("echousd.make.save.PREVIEW", 16)
    write_obj(tmp_path / "models", "wardrobe", chest(1.0, 2.0, 0.5))
    file = index([tmp_path / "models"], tmp_path / "lib.parquet").file
    (record,) = read_library(file).records.values()
    content = file.read_bytes()
    (tmp_path / "g.json").write_text('{"room": "bedroom", "nodes": ["wardrobe"]}')
    for number in range(MANY):
        rng = random.Random(f"index {number}")
        if number % 3 == 0:
            wrong = bytearray(content)
            for _ in range(rng.choice((1, 3, 30))):
                wrong[rng.randrange(len(wrong))] = rng.randrange(256)
            file.write_bytes(bytes(wrong))
        else:
            names = rng.sample([field.name for field in fields(record)], rng.choice((1, 2)))
            try:
                write_library(file, [replace(record, **{name: odd(getattr(record, name), rng) for name in names})])
            except (TypeError, ValueError, UnicodeError):  # of no type that a table could hold
                continue
        os.utime(file, ns=(number, number))  # another one than before
        done = echousd_command(
            "generate", tmp_path / "g.json", "-o", tmp_path / f"out_{number}", "--shapes", "library", "--assets", file,
            "--no-place", "--dress", "none", "--no-walls", "--no-preview",
        )  # fmt: skip
        fine(done, tmp_path)
        shutil.rmtree(tmp_path / f"out_{number}", ignore_errors=True)


@pytest.mark.skipif(sys.platform != "linux", reason="no other system counts what a process holds")
def test_none_of_them_took_a_gigabyte():
    """As what a process once held is counted for ever, this is the last test here."""
    held = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    assert int(held.split()[1]) < 2**20 or "PYTEST_XDIST_WORKER" in os.environ  # others have filled it, too
