"""What opening many rooms costs: layers as text, as usdc, with instances, and one flat file each.

    python benchmarks/opening.py [GRAPH] [--rooms 100] [--shapes parts]

One room is made in each form and copied, so that every copy has layers of its own, as separate rooms have.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from pxr import Usd

import echousd
from echousd.exporting.formats import export
from echousd.options import RoomOptions

SAMPLES = Path(__file__).parents[1] / "samples"
FORMS = {"text": {}, "usdc (--crate)": {"crate": True}, "text, --instances": {"instances": True}}


def opened(files: list[Path]) -> tuple[float, int]:
    """CPU seconds that opening files takes, and how many layers they have together."""
    started = time.process_time()
    stages = [Usd.Stage.Open(str(file)) for file in files]
    spent = time.process_time() - started
    return spent, len({layer.identifier for stage in stages for layer in stage.GetUsedLayers() if not layer.anonymous})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("graph", type=Path, nargs="?", default=SAMPLES / "bedroom.usda")
    parser.add_argument("--rooms", type=int, default=100)
    parser.add_argument("--shapes", default="parts")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        for name, form in FORMS.items():
            how = RoomOptions(walls=True, dress="some", **form)
            made = echousd.generate(options.graph, seed=7, shapes=options.shapes, options=how, drafts=1)
            root = made.save(Path(scratch) / f"form_{len(name)}", preview=False)
            copies = [Path(scratch) / f"{root.stem}_{number}" for number in range(options.rooms)]
            for copy in copies:
                shutil.copytree(root.parent, copy)
            spent, layers = opened([copy / root.name for copy in copies])
            print(f"{name}: {spent:.2f} s of the processor, {layers} layers", flush=True)
            if name == "text":
                flat = export(root, Path(scratch) / "flat.usdc")
                files = [flat.with_name(f"flat_{number}.usdc") for number in range(options.rooms)]
                for file in files:
                    shutil.copy(flat, file)
                spent, layers = opened(files)
                print(f"flat: {spent:.2f} s of the processor, {layers} layers", flush=True)


if __name__ == "__main__":
    main()
