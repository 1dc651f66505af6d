"""Bakes the images of the rooms that most people make first, `echousd/shapes/finishes/baked/*.jpg`, which ship.

    python docs/make_baked.py

They are those of `echousd new --room TYPE` and `generate` without a seed, for the five everyday types. `index.json`
says what each was asked for; an empty file, that there is no image. To be run again when patterns or prints change.
"""

import json
import tempfile
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import echousd
from echousd.graph import starting_graph
from echousd.make.save import save_layers
from echousd.shapes.finishes import baking, pictures

TYPES = ("bedroom", "living_room", "dining_room", "study", "living_dining_room")


def main() -> None:
    """Write the images that these rooms ask for, and what each was asked for; take away all others."""
    asked: dict[str, tuple[str, Any]] = {}

    def noted(bake: Callable[..., bytes | None], *given: Any) -> bytes | None:
        file, image = baking.baked_file(bake.__name__, given), bake(*given)
        file.write_bytes(image or b"")
        asked[file.name] = bake.__name__, given
        return image

    baking.BAKED.mkdir(exist_ok=True)
    for file in baking.BAKED.iterdir():
        file.unlink()
    for name in ("color_image", "normal_image", "rough_image"):
        setattr(baking, name, partial(noted, getattr(pictures, name)))
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as folder:
        for kind in TYPES:
            save_layers(echousd.generate(starting_graph(kind), progress=None), Path(folder) / kind)
    (baking.BAKED / "index.json").write_text(json.dumps(dict(sorted(asked.items())), indent=0) + "\n")


if __name__ == "__main__":
    main()
