"""A picture of every asset of a room, where hosts look for one: `.thumbs/256x256/<file>.png` beside it."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path

from echousd.stage.paths import component_file, thumbnail_file

SIZE = 256  # pixels


def thumbnails(files: Mapping[str, bytes], names: Iterable[str]) -> dict[str, bytes]:
    """Path in the room's folder -> PNG of each asset that has none yet, in the plain colours that it has by itself.

    Arguments:
        files: relative path -> content of the room's assets. names: of the assets.

    Raises RenderUnavailable (a ValueError) without the extra `render`.
    """
    wanted = [name for name in names if thumbnail_file(name) not in files and component_file(name) in files]
    found: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        for name in wanted:
            own = {path: content for path, content in files.items() if path.startswith(f"assets/{name}/")}
            for path, content in own.items():
                place = Path(folder) / path
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(content)
            found[thumbnail_file(name)] = picture(Path(folder) / component_file(name))
    return found


def picture(asset: Path) -> bytes:
    """A PNG of a stage with one piece on it, from a corner; raises ValueError where there is nothing to see."""
    from echousd.draw.rendering import QUICK, render

    out = io.BytesIO()
    render(asset, size=SIZE, rays=QUICK).save(out, "PNG")
    return out.getvalue()
