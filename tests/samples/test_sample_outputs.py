"""The five samples come out as before: boxes as numbers, layers as digests, both in `sample_outputs.json`.

`python tests/samples/test_sample_outputs.py` makes the numbers anew, after a change that is meant.
"""

import hashlib
import json
import re
from pathlib import Path

import numpy as np
import pytest
import torch
from pxr import Usd

import echousd
from echousd.room.compose import room_files

SAMPLES = sorted((Path(__file__).parents[2] / "samples").glob("*.yaml"))
OUTPUTS = Path(__file__).with_name("sample_outputs.json")
SEED = 0
RENEW = "python tests/samples/test_sample_outputs.py"
# version of the package, hash of the weights: they change more often than what they make
MADE_BY = re.compile(rb"^ *string (generator|model) = .*\n", re.MULTILINE)


def versions():
    return {"torch": torch.__version__, "numpy": np.__version__, "usd": ".".join(map(str, Usd.GetVersion()))}


def output(sample):
    """What a sample gives: width, height, depth, x, y, z in 0.1 mm and turn in 0.01 degrees of every object, which is
    what stages hand on (`echousd/room/reproducible.py`), and digests of the layers that are text."""
    room = echousd.generate(sample, seed=SEED, shapes="boxes")
    size, position, yaw = (np.asarray(value, float) for value in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    numbers = np.c_[size * 1e4, position * 1e4, np.rad2deg(yaw) * 100]
    boxes = np.rint(numbers).astype(int).tolist()
    texts = {path: text for path, text in room_files(room).items() if path.endswith(".usda") and "assets/" not in path}
    layers = {path: hashlib.sha256(MADE_BY.sub(b"", texts[path])).hexdigest()[:16] for path in sorted(texts)}
    return {"boxes": dict(zip(room.names, boxes, strict=True)), "layers": layers}


def differences(before, now):
    """One sentence for every box and layer that is not as it was."""
    kinds = {"boxes": "(w, h, d, x, y, z in 0.1 mm, turn in 0.01 degrees) ", "layers": ""}
    return [
        f"{name} {unit}was {before[kind].get(name, 'not there')}, is {now[kind].get(name, 'gone')}"
        for kind, unit in kinds.items()
        for name in sorted(before[kind].keys() | now[kind].keys())
        if before[kind].get(name) != now[kind].get(name)
    ]


def told(sample, found, made_with):
    """What the failing test says: what differs, and what to do about it."""
    here = versions()
    lines = [
        f"{sample} at seed {SEED} is not what it was:",
        *(f"  {line}" for line in found),
        "What the samples look like changes on purpose or not at all.",
        f"If it is meant, say so in CHANGELOG.md and renew {OUTPUTS.name} with",
        f"  {RENEW}",
    ]
    if made_with != here:
        lines.append(f"It was made with {made_with}, here is {here}: that alone may round otherwise.")
    return "\n".join(lines)


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.stem)
def test_the_samples_come_out_as_before(sample):
    kept = json.loads(OUTPUTS.read_text("utf-8"))
    found = differences(kept["samples"].get(sample.stem, {"boxes": {}, "layers": {}}), output(sample))
    assert found == [], told(sample.stem, found, kept["made_with"])


def test_every_sample_is_kept_and_a_change_is_told():
    kept = json.loads(OUTPUTS.read_text("utf-8"))
    assert list(kept["samples"]) == [sample.stem for sample in SAMPLES]
    before = {"boxes": {"bed": [1, 2], "lamp": [3, 4]}, "layers": {"layers/graph.usda": "ab"}}
    now = {"boxes": {"bed": [1, 5], "lamp": [3, 4]}, "layers": {"layers/graph.usda": "ab", "room.usda": "cd"}}
    found = differences(before, now)
    assert [line.split()[0] for line in found] == ["bed", "room.usda"]
    assert found[0].endswith("was [1, 2], is [1, 5]")
    text = told("bedroom", found, {**versions(), "torch": "1.0"})
    assert RENEW in text
    assert "on purpose or not at all" in text
    assert "made with" in text
    assert "made with" not in told("bedroom", found, versions())


if __name__ == "__main__":
    rows = {sample.stem: output(sample) for sample in SAMPLES}
    text = json.dumps({"made_with": versions(), "seed": SEED, "samples": rows}, indent=1)
    text = re.sub(r"\[[^\]]*\]", lambda row: " ".join(row[0].split()), text)  # a box is one line
    OUTPUTS.write_text(f"{text}\n", "utf-8")
