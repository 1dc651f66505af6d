"""The five samples come out as before: boxes and the numbers of layers, and the words between them as digests.

Exactly so where torch, numpy, OpenUSD and the processor's instructions are those that `sample_outputs.json` names;
elsewhere sums are rounded otherwise, and numbers may differ by the tolerances below. `python
tests/samples/test_sample_outputs.py` makes the file anew, after a change that is meant.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy._core._multiarray_umath import __cpu_features__
from pxr import Usd

import echousd
from echousd.layers.compose import room_files

SAMPLES = sorted((Path(__file__).parents[2] / "samples").glob("*.yaml"))
OUTPUTS = Path(__file__).with_name("sample_outputs.json")
SEED = 0
RENEW = "python tests/samples/test_sample_outputs.py"
# version of the package, hash of the weights: they change more often than what they make
MADE_BY = re.compile(rb"^ *string (generator|model) = .*\n", re.MULTILINE)
NUMBER = re.compile(rb"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
TOLERANCE = np.array([5, 5, 5, 5, 5, 5, 5])  # 0.5 mm, and 0.05 degrees
TURN = 36000  # hundredths of a degree
SHARE, LEAST = 0.01, 5e-4  # of a layer's number: masses and lights follow the sizes, three factors at once
# What stands for another machine here: torch's kernels, MKL's and oneDNN's without their widest instructions.
MACHINES = {
    "default": {"ATEN_CPU_CAPABILITY": "default", "MKL_CBWR": "COMPATIBLE", "ONEDNN_MAX_CPU_ISA": "SSE41"},
    "avx2": {"ATEN_CPU_CAPABILITY": "avx2", "MKL_CBWR": "AVX2", "ONEDNN_MAX_CPU_ISA": "AVX2"},
    "avx512": {"ATEN_CPU_CAPABILITY": "avx512", "ONEDNN_MAX_CPU_ISA": "AVX512_CORE"},
}
DRAWN = {name: SAMPLES[number :: len(MACHINES)] for number, name in enumerate(MACHINES)}  # every sample on one of them


def machine():
    """What decides how sums are rounded: versions, and the instructions that torch and numpy choose by."""
    widest = [name for name, there in __cpu_features__.items() if there][-1]
    limits = [f"{name}={os.environ[name]}" for name in sorted(MACHINES["default"]) if name in os.environ]
    instructions = " ".join([torch.backends.cpu.get_cpu_capability(), widest, *limits])
    usd = ".".join(map(str, Usd.GetVersion()))
    return {"torch": torch.__version__, "numpy": np.__version__, "usd": usd, "instructions": instructions}


def output(sample):
    """What a sample gives: width, height, depth, x, y, z in 0.1 mm and turn in 0.01 degrees of every object, which is
    what stages hand on (`echousd/graph/arrays.py`), and of the layers that are text the numbers and a digest of
    what stands between them."""
    room = echousd.generate(sample, seed=SEED, shapes="boxes", walls=False, dress="none")
    size, position, yaw = (np.asarray(value, float) for value in (room.boxes.size, room.boxes.position, room.boxes.yaw))
    numbers = np.c_[size * 1e4, position * 1e4, np.rad2deg(yaw) * 100]
    boxes = np.rint(numbers).astype(int).tolist()
    texts = {path: text for path, text in room_files(room).items() if path.endswith(".usda") and "assets/" not in path}
    layers = {path: layer(MADE_BY.sub(b"", texts[path])) for path in sorted(texts)}
    return {"boxes": dict(zip(room.names, boxes, strict=True)), "layers": layers}


def layer(text):
    """The numbers of a layer and a digest of its words."""
    words = hashlib.sha256(NUMBER.sub(b"#", text)).hexdigest()[:16]
    return {"words": words, "numbers": [float(number) for number in NUMBER.findall(text)]}


def differences(before, now, *, exact):
    """One sentence for every box and layer that is not as it was."""
    out = []
    for name in sorted(before["boxes"].keys() | now["boxes"].keys()):
        was, is_ = before["boxes"].get(name, "not there"), now["boxes"].get(name, "gone")
        if not (was == is_ if exact or str in (type(was), type(is_)) else near_boxes(was, is_)):
            out.append(f"{name} (w, h, d, x, y, z in 0.1 mm, turn in 0.01 degrees) was {was}, is {is_}")
    for name in sorted(before["layers"].keys() | now["layers"].keys()):
        was, is_ = before["layers"].get(name), now["layers"].get(name)
        if was is None or is_ is None:
            out.append(f"{name} {'is new' if was is None else 'is gone'}")
        elif was["words"] != is_["words"]:
            out.append(f"{name} other words than before ({was['words']}, {is_['words']})")
        elif not near_numbers(was["numbers"], is_["numbers"], exact=exact):
            pairs = zip(was["numbers"], is_["numbers"], strict=True)
            out.append(f"{name} other numbers than before: {[pair for pair in pairs if pair[0] != pair[1]][:3]} ...")
    return out


def near_boxes(was, is_):
    away = np.abs(np.subtract(was, is_))
    away[6] = min(away[6] % TURN, -away[6] % TURN)
    return bool((away <= TOLERANCE).all())


def near_numbers(was, is_, *, exact):
    if exact or len(was) != len(is_):
        return was == is_
    return np.allclose(was, is_, rtol=SHARE, atol=LEAST)


def explained(sample, found, made_with):
    """What the failing test says: what differs, and what to do about it."""
    here = machine()
    lines = [
        f"{sample} at seed {SEED} is not what it was:",
        *(f"  {line}" for line in found),
        "What the samples look like changes on purpose or not at all.",
        f"If it is meant, say so in CHANGELOG.md and renew {OUTPUTS.name} with",
        f"  {RENEW}",
    ]
    if made_with != here:
        lines.append(f"It was made with {made_with}, here is {here}: numbers were compared with a tolerance.")
    return "\n".join(lines)


@pytest.fixture(scope="module")
def kept():
    return json.loads(OUTPUTS.read_text("utf-8"))


def made_elsewhere(name):
    """What one of `MACHINES` makes of its samples, drawn in a process of its own."""
    code = (
        f"import sys, json; sys.path.insert(0, {str(OUTPUTS.parent)!r}); import test_sample_outputs as t; "
        f"print(json.dumps([t.machine(), {{sample.stem: t.output(sample) for sample in t.DRAWN[{name!r}]}}]))"
    )
    environment = os.environ | MACHINES[name]
    done = subprocess.run([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda path: path.stem)
def test_the_samples_come_out_as_before(sample, kept):
    exact = kept["made_with"] == machine()
    found = differences(kept["samples"].get(sample.stem, {"boxes": {}, "layers": {}}), output(sample), exact=exact)
    assert found == [], explained(sample.stem, found, kept["made_with"])


@pytest.mark.parametrize("name", MACHINES)
def test_other_machines_differ_by_less_than_one_sees(name, kept):
    made_with, rooms = made_elsewhere(name)
    assert made_with != kept["made_with"]  # nothing that is exact by name alone
    found = [line for sample, room in rooms.items() for line in differences(kept["samples"][sample], room, exact=False)]
    assert found == []


def test_every_sample_is_kept_and_a_change_is_explained(kept):
    assert list(kept["samples"]) == [sample.stem for sample in SAMPLES]
    text = explained("bedroom", ["bed was here"], {**machine(), "torch": "1.0"})
    assert RENEW in text
    assert "on purpose or not at all" in text
    assert "tolerance" in text
    assert "tolerance" not in explained("bedroom", ["bed was here"], machine())


def layers(text):
    return {"graph": layer(text)}


def test_exactly_every_number_counts_and_elsewhere_only_what_one_sees():
    before = {"boxes": {"bed": [1, 2, 3, 4, 5, 6, 0]}, "layers": layers(b"mass = 10.5 of bed_1")}
    nearly = {"boxes": {"bed": [1, 2, 3, 4, 5, 11, 35996]}, "layers": layers(b"mass = 10.51 of bed_1")}
    further = {"boxes": {"bed": [1, 2, 3, 4, 5, 12, 0]}, "layers": layers(b"mass = 10.7 of bed_1")}
    turned = {"boxes": {"bed": [1, 2, 3, 4, 5, 6, 6]}, "layers": layers(b"mass = 10.5 of bed_2")}
    other = {"boxes": {"lamp": [1]}, "layers": {}}
    assert differences(before, before, exact=True) == []
    assert [line.split()[0] for line in differences(before, nearly, exact=True)] == ["bed", "graph"]
    assert differences(before, nearly, exact=False) == []
    assert [line.split()[0] for line in differences(before, further, exact=False)] == ["bed", "graph"]
    assert [line.split()[0] for line in differences(before, turned, exact=False)] == ["bed", "graph"]
    assert [line.split()[0] for line in differences(before, other, exact=False)] == ["bed", "lamp", "graph"]
    longer = {**before, "layers": layers(b"mass = 10.5 of bed_1 (0, 0)")}
    assert [line.split()[0] for line in differences(before, longer, exact=False)] == ["graph"]


if __name__ == "__main__":
    rows = {sample.stem: output(sample) for sample in SAMPLES}
    text = json.dumps({"made_with": machine(), "seed": SEED, "samples": rows}, indent=1)
    text = re.sub(r"\[[^\]]*\]", lambda row: " ".join(row[0].split()), text)  # a box is one line
    OUTPUTS.write_text(f"{text}\n", "utf-8")
