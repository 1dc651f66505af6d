"""Our pictures from inside beside what Blender's path tracer makes of the very same files, through the same camera.

    python benchmarks/beside_cycles.py FOLDER --lot 30110934 --count 20 --first 10 --blender BLENDER/bin/python

Graphs that people wrote and seeds are drawn by lot and made with a ceiling, as others' renderers see rooms from inside;
each is drawn by Cycles in a Python that has `bpy`, and by us. Of rooms from `--first` on: how far the light's logarithm
to the base of 2 is off what Cycles has, less its median over the room (exposure), as root of the mean square and mean
over all surfaces and by kind, signed and not; percentiles of how bright the pictures are, Cycles' exposed to the same
median; how saturated they are. FOLDER/sheet_N.png: ours at the left.
"""

from __future__ import annotations

import argparse
import subprocess
from collections import defaultdict
from pathlib import Path

import numpy as np
from PIL import Image
from pxr import Usd
from room_sheets import drawn_by_lot, graphs_of

from echousd import generate
from echousd.draw import tracing
from echousd.draw.indoors import LUMA, SUN, Bounced
from echousd.draw.scenery import Scenery, read_scenery, with_ceiling
from echousd.draw.views import View, hero_view
from echousd.options import RoomOptions

SIZE, SAMPLES = 320, 20
BLENDER = Path(__file__).parents[1] / "tests" / "clients" / "blender_render.py"
PERCENTILES = (1, 5, 25, 50, 75, 95, 99)


def measured(scenery: Scenery, view: View) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """(3, n) radiance of our picture before it is exposed, and which pixels are of each kind of surface."""
    height, sun = round(SIZE / view.aspect), scenery.lights.sun
    world = tracing._lit(
        tracing.World(
            tracing.embree(scenery.triangles), scenery, view, SIZE, np.random.default_rng(0).random(4),
            Bounced.dark(*scenery.bounds), np.float32(SUN / np.pi) * (np.zeros(3, "f4") if sun is None else sun[1]),
        )
    )  # fmt: skip
    _, seen = tracing._met(world, np.arange(height * SIZE), np.full((2, 1), 0.5))
    near = tracing._at_edges(world, seen, (height, SIZE))
    light = tracing._light_of(world, seen, near, near, 4, 1)
    world = world._replace(atlas=scenery.atlas(seen.face, tracing._breadth(world, seen)))
    color, face, high = tracing._colored(world, seen, light), seen.face, scenery.bounds[1][1]
    up, share = seen.normal[1], seen.point[1] / high  # the floor is at 0
    all_, sunny = (face >= 0) & ~scenery.planes.glows.take(face), light[4] > 0.2
    wall, shade = all_ & (scenery.wall[face] >= 0), all_ & ~sunny
    upright, thing = wall & (np.abs(up) < 0.3), shade & ~wall & (share > 0.02) & (share < 0.9)
    return color, {
        "all": all_, "walls' upper quarter": upright & (share > 0.75),
        "their middle": upright & (share <= 0.75) & (share > 0.3), "their lower third": upright & (share <= 0.3),
        "ceiling": all_ & (up < -0.9) & (share > 0.9), "floor": shade & (up > 0.9) & (share <= 0.02),
        "tops of things": thing & (up > 0.7), "their sides": thing & (np.abs(up) < 0.5), "in the sun": all_ & sunny,
        "curtains": all_ & (scenery.thin[face] > 0), "metals": all_ & (scenery.gloss[face] > tracing.METAL),
    }  # fmt: skip


def main() -> None:
    """Make, draw and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--lot", type=int, required=True)
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--blender", default="python", help="a Python that has bpy")
    options, rows = parser.parse_args(), []
    kinds: dict[str, list[tuple[float, float, int]]] = defaultdict(list)
    tones = []
    lot = drawn_by_lot(list(graphs_of(["people", "more"])), options.count, options.lot)
    for number, (name, graph, seed) in enumerate(lot):
        room, truth = (options.folder / f"c{number:02d}", options.folder / f"c{number:02d}.npy")
        if number < options.first:
            continue
        if not room.exists():
            generate(graph, seed=seed, options=RoomOptions(walls=True, ceiling=True)).save(room, preview=False)
        stage = room / f"{room.name}.usda"
        if not truth.exists():
            told = ["--size", str(SIZE), "--samples", str(SAMPLES)]
            subprocess.run([options.blender, str(BLENDER), "--", str(stage), str(truth), *told], check=True)
        opened = Usd.Stage.Open(str(stage))
        scenery = read_scenery(opened)
        view, scenery = hero_view(opened, scenery), with_ceiling(scenery)
        color, masks = measured(scenery, view)
        other, ours = np.load(truth), tracing.trace(scenery, view, SIZE, rays=2)
        off = np.log2(np.maximum(LUMA @ color, 1e-4)) - np.log2(np.maximum(other.reshape(-1, 3) @ LUMA, 1e-4))
        off -= np.median(off[masks["all"]])
        for kind, mask in masks.items():
            kinds[kind].append((off[mask].sum(), np.abs(off[mask]).sum(), mask.sum()))
        square = np.sqrt(np.square(off[masks["all"]]).mean())
        rows.append(square)
        other *= np.median(ours**2.2 @ LUMA) / np.median(other @ LUMA)
        other = np.clip(other, 0, 1) ** (1 / 2.2)
        for picture, found in ((ours, []), (other, [])):
            found += np.percentile((picture**2.2 @ LUMA) ** (1 / 2.2), PERCENTILES).tolist()
            tones.append([*found, float((np.ptp(picture, axis=2) / np.maximum(picture.max(2), 1e-3)).mean())])
        both = np.concatenate([ours, other], 1)
        Image.fromarray((both * 255).astype("u1")).save(options.folder / f"sheet_{number:02d}.png")
        print(f"{number} {name} seed {seed}: {square:.3f}", flush=True)
    print(f"{len(rows)} rooms, root of the mean square {np.mean(rows):.3f}")
    for kind, found in kinds.items():
        signed, size, many = np.sum(found, 0)
        print(f"  {kind}: {signed / max(many, 1):+.2f}, {size / max(many, 1):.2f}")
    for word, values in zip(("ours", "Cycles"), np.reshape(tones, (-1, 2, len(PERCENTILES) + 1)).mean(0), strict=True):
        print(f"{word}: percentiles {PERCENTILES} {values[:-1].round(2)}, saturation {values[-1]:.3f}")


if __name__ == "__main__":
    main()
