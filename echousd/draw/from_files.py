"""Pictures of rooms and models in files: one, one through each camera, a turn around the room, thumbnails."""

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from pxr import Usd

from echousd.draw.outside import turning_views, without_near_walls
from echousd.draw.rendering import HERO, as_image, cameras_of, render_stage, scenery_of
from echousd.draw.tracing import FINE, QUICK, trace
from echousd.stage.files import open_stage
from echousd.stage.paths import asset_file, thumbnail_file
from echousd.stage.showing import showing_layout, showing_variant
from echousd.textures import encoded

LIGHT = "light"  # the variant set of a room's day, evening and night
FRAMES = (2, 360)  # pictures that a turn may have
SIZE = 256  # pixels of a thumbnail


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
        scenery = scenery_of(stage, size, colors)
        return {name: as_image(trace(scenery, view, size, rays=rays)) for name, view in cameras_of(stage).items()}


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
        scenery = scenery_of(stage, size, colors)
    return [
        as_image(trace(without_near_walls(scenery, view.matrix[:3, 3]), view, size, rays=rays))
        for view in turning_views(scenery, frames)
    ]


def thumbnails(files: Mapping[str, bytes], names: Iterable[str]) -> dict[str, bytes]:
    """Path in the room's folder -> PNG of each asset that has none yet, in the plain colours that it has by itself.

    `files`: relative path -> content of the room's assets. `names`: of the assets. Raises RenderUnavailable (a
    ValueError) without the extra `render`.
    """
    wanted = [name for name in names if thumbnail_file(name) not in files and asset_file(name) in files]
    found: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        for name in wanted:
            own = {path: content for path, content in files.items() if path.startswith(f"assets/{name}/")}
            for path, content in own.items():
                place = Path(folder) / path
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(content)
            found[thumbnail_file(name)] = picture(Path(folder) / asset_file(name))
    return found


def picture(asset: Path) -> bytes:
    """A PNG of a stage with one piece on it, from a corner; raises ValueError where there is nothing to see."""
    return encoded(render(asset, size=SIZE, rays=QUICK))
