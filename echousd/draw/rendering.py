"""Pictures of any stage without a GPU or a display: one view, or a sheet of several."""

from dataclasses import replace

import numpy as np
from PIL import Image
from pxr import Usd

from echomodel.late import Late
from echousd.draw.scenery import Scenery, read_scenery, with_ceiling
from echousd.draw.tracing import FINE, QUICK, trace
from echousd.draw.views import View, hero_view, stage_views
from echousd.stage.values import reading

EVERY, CONTACT = "every-camera", "sheet"
HERO, DOLLHOUSE = "hero", "dollhouse"
VIEWS = (HERO, DOLLHOUSE, "top", EVERY, CONTACT)
COLORS = ("materials", "class")
LARGEST, GREY = 4096, 0.905  # pixels; beside a picture that is wider than high
corner_views, top_view = (Late(f"echousd.draw.outside:{name}") for name in ("corner_views", "top_view"))
QUALITIES = {"fast": (640, QUICK), "fine": (1280, FINE)}  # pixels across, rays along each side of a pixel


def render_stage(
    stage: Usd.Stage, *, view: str = HERO, size: int = 512, colors: str = "materials", rays: int = FINE
) -> Image.Image:
    """A picture of everything visible on a stage; `every-camera` and `sheet` are several of them.

    Arguments:
        stage: any stage; its up axis and units are taken care of.
        view: `hero` (8:5, from inside, with a ceiling, lit by windows and lamps; of a stage without walls as
            `dollhouse`), `dollhouse` (from above a corner, without the walls before it), `top` (orthographic, the
            front, +X of a Y-up stage, is up), `every-camera` (through every camera of the stage, in the order of their
            paths), or `sheet` (dollhouse, hero, top in a row; below from the other corners).
        size: pixels across, 16 to 4096.
        colors: `materials`, or `class` for one flat colour per category.
        rays: along each side of a pixel.

    Raises:
        ValueError: unknown view, colours or size, nothing to see, no camera for `every-camera`, or Embree missing.
    """
    if view not in VIEWS:
        raise ValueError(f"view is {view!r}, allowed: {', '.join(VIEWS)}")
    scenery = scenery_of(stage, size, colors)
    if view == EVERY:
        cameras = [replace(camera, aspect=1.0) for camera in cameras_of(stage).values()]
        return as_image(np.concatenate([trace(scenery, camera, size, rays=rays) for camera in cameras], axis=1))
    if view != CONTACT:
        return as_image(_seen(stage, scenery, view, size, rays))
    corner, *others = (trace(shown, camera, size, rays=rays) for camera, shown in corner_views(scenery))
    inside = _inside(stage, scenery, size, rays)
    bars = ((size - len(inside)) // 2, (size - len(inside) + 1) // 2), (0, 0), (0, 0)
    first = [corner, np.pad(inside, bars, constant_values=GREY), _seen(stage, scenery, "top", size, rays)]
    return as_image(np.concatenate([np.concatenate(row, axis=1) for row in (first, others)]))


def _seen(stage: Usd.Stage, scenery: Scenery, view: str, size: int, rays: int) -> np.ndarray:
    """(height, size, 3) what one of the views `hero`, `dollhouse` and `top` shows."""
    if view == "top":
        camera = top_view(scenery)
    elif view == HERO and scenery.closed:
        return _inside(stage, scenery, size, rays)
    else:
        camera, scenery = next(corner_views(scenery))
    return trace(scenery, camera, size, rays=rays)


def _inside(stage: Usd.Stage, scenery: Scenery, size: int, rays: int) -> np.ndarray:
    """(height, size, 3) what the view from inside shows, below a ceiling where there are walls all around."""
    camera = hero_view(stage, scenery)
    return trace(with_ceiling(scenery) if scenery.closed else scenery, camera, size, rays=rays)


def cameras_of(stage: Usd.Stage) -> dict[str, View]:
    """What the cameras of a stage see, by their names; raises ValueError where there is none."""
    if not (found := stage_views(stage)):
        raise ValueError(f"{stage.GetRootLayer().identifier}: no camera, which --cameras and view every-camera need")
    return found


def scenery_of(stage: Usd.Stage, size: int, colors: str) -> Scenery:
    """What there is to draw; raises ValueError for colours or a size that there is not."""
    if colors not in COLORS:
        raise ValueError(f"colors is {colors!r}, allowed: {', '.join(COLORS)}")
    if not 16 <= size <= LARGEST:
        raise ValueError(f"size is {size} pixels, allowed: 16 to {LARGEST}")
    with reading(stage):
        return read_scenery(stage, by_class=colors == "class", halved=int(size < QUALITIES["fine"][0]))


def as_image(pixels: np.ndarray) -> Image.Image:
    """The image of pixels (height, width, 3) float, 0 to 1."""
    return Image.fromarray((np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8))
