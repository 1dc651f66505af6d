"""Pictures of any stage without a GPU or a display: one view, a sheet of several, or a turn around the room."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echousd.draw.indoors import with_ceiling
from echousd.draw.scenery import Scenery, read_scenery
from echousd.draw.tracing import FINE, QUICK, trace
from echousd.draw.views import View, corner_views, hero_view, stage_views, top_view, turning_views

if TYPE_CHECKING:
    from PIL import Image
    from pxr import Usd

EVERY, CONTACT = "every-camera", "sheet"
HERO, DOLLHOUSE = "hero", "dollhouse"
VIEWS = (HERO, DOLLHOUSE, "top", EVERY, CONTACT)
COLORS = ("materials", "class")
SHEET = (HERO, "top")  # beside the best corner in the first row; below, the views from the others
LARGEST = 4096
QUALITIES = {"fast": (640, QUICK), "fine": (1280, FINE)}  # pixels across, rays along each side of a pixel
LIGHT = "light"  # the variant set of a room's day, evening and night
FRAMES = (2, 360)  # pictures that a turn may have


def render(
    room: str | Path, *, view: str = HERO, size: int = 512, colors: str = "materials", rays: int = FINE,
    layout: int | str | None = None, light: str | None = None,
) -> Image.Image:  # fmt: skip
    """A picture of the room in a file, in one of its layouts and lights (None: what it shows); see `render_stage`.

    `light`: day, evening or night. Raises ValueError where it cannot be opened, or has no such layout or light.
    """
    with _showing(room, layout, light) as stage:
        return render_stage(stage, view=view, size=size, colors=colors, rays=rays)


@contextmanager
def _showing(path: str | Path, layout: int | str | None, light: str | None) -> Iterator[Usd.Stage]:
    """A stage that shows one of its layouts and lights within the block; raises ValueError for what there is not."""
    from echousd.stage.files import open_stage
    from echousd.stage.showing import showing_layout, showing_variant

    stage = open_stage(path)
    if light is None:
        with showing_layout(stage, layout):
            yield stage
        return
    sets = [prim.GetVariantSet(LIGHT) for prim in stage.GetPseudoRoot().GetChildren()]
    names = sorted({name for found in sets for name in found.GetVariantNames()})
    if light not in names:
        raise ValueError(f"{path}: light is {light!r}, allowed: {', '.join(names) or 'none, it has no such variants'}")
    with showing_layout(stage, layout), showing_variant(stage, LIGHT, light):
        yield stage


def render_cameras(
    path: str | Path, *, size: int = 512, colors: str = "materials", rays: int = FINE,
    layout: int | str | None = None, light: str | None = None,
) -> dict[str, Image.Image]:  # fmt: skip
    """A picture of the room in a file through each of its cameras, by the camera's name; see `render`.

    Raises ValueError as `render` does, and where the stage holds no camera.
    """
    with _showing(path, layout, light) as stage:
        scenery = _scenery(stage, size, colors)
        return {name: _image(trace(scenery, view, size, rays=rays)) for name, view in _cameras(stage).items()}


def render_stage(
    stage: Usd.Stage, *, view: str = HERO, size: int = 512, colors: str = "materials", rays: int = FINE
) -> Image.Image:
    """A picture of everything visible on a stage; `every-camera` and `sheet` are several of them.

    Arguments:
        stage: any stage; its up axis and units are taken care of.
        view: `hero` (8:5, from inside, with a ceiling, lit by windows and lamps; of a stage without walls as
            `dollhouse`), `dollhouse` (from above a corner, without the walls before it), `top` (orthographic, -Z of a
            Y-up stage is up in the picture), `every-camera` (through every camera of the stage, in the order of their
            paths), or `sheet` (dollhouse, hero, top; below from the other corners).
        size: pixels across, 16 to 4096.
        colors: `materials`, or `class` for one flat colour per category.
        rays: along each side of a pixel.

    Raises:
        ValueError: unknown view, colours or size, nothing to see, no camera for `every-camera`, or Embree missing.
    """
    if view not in VIEWS:
        raise ValueError(f"view is {view!r}, allowed: {', '.join(VIEWS)}")
    scenery = _scenery(stage, size, colors)
    if view == EVERY:
        cameras = [replace(camera, aspect=1.0) for camera in _cameras(stage).values()]
        return _image(np.concatenate([trace(scenery, camera, size, rays=rays) for camera in cameras], axis=1))
    if view != CONTACT:
        return _image(_seen(stage, scenery, view, size, rays))
    corner, *others = (trace(shown, camera, size, rays=rays) for camera, shown in corner_views(scenery))
    first = [corner, *(_seen(stage, scenery, word, size, rays, square=True) for word in SHEET)]
    return _image(np.concatenate([np.concatenate(row, axis=1) for row in (first, others)]))


def render_turn(
    path: str | Path, *, frames: int = 24, size: int = 320, colors: str = "materials", rays: int = QUICK,
    layout: int | str | None = None, light: str | None = None,
) -> list[Image.Image]:  # fmt: skip
    """Pictures of the room in a file from all around, the walls towards the camera left out; see `render`.

    Raises ValueError as `render` does, and for a number of frames outside `FRAMES`.
    """
    if not FRAMES[0] <= frames <= FRAMES[1]:
        raise ValueError(f"frames is {frames}, allowed: {FRAMES[0]} to {FRAMES[1]}")
    with _showing(path, layout, light) as stage:
        scenery = _scenery(stage, size, colors)
    return [
        _image(trace(scenery.without_near_walls(view.matrix[:3, 3]), view, size, rays=rays))
        for view in turning_views(scenery, frames)
    ]


def _seen(stage: Usd.Stage, scenery: Scenery, view: str, size: int, rays: int, *, square: bool = False) -> np.ndarray:
    """(height, size, 3) what one of the views `hero`, `dollhouse` and `top` shows."""
    if view == "top":
        camera = top_view(scenery)
    elif view == HERO and (scenery.closed or square):
        camera = hero_view(stage, scenery)
        scenery = with_ceiling(scenery) if scenery.closed else scenery
    else:
        camera, scenery = next(corner_views(scenery))
    return trace(scenery, replace(camera, aspect=1.0) if square else camera, size, rays=rays)


def _cameras(stage: Usd.Stage) -> dict[str, View]:
    if not (found := stage_views(stage)):
        raise ValueError(f"{stage.GetRootLayer().identifier}: no camera, which --cameras and view every-camera need")
    return found


def _scenery(stage: Usd.Stage, size: int, colors: str) -> Scenery:
    """What there is to draw; raises ValueError for colours or a size that there is not."""
    from echousd.stage.values import reading

    if colors not in COLORS:
        raise ValueError(f"colors is {colors!r}, allowed: {', '.join(COLORS)}")
    if not 16 <= size <= LARGEST:
        raise ValueError(f"size is {size} pixels, allowed: 16 to {LARGEST}")
    with reading(stage):
        return read_scenery(stage, by_class=colors == "class")


def _image(pixels: np.ndarray) -> Image.Image:
    from PIL import Image

    return Image.fromarray((np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8))
