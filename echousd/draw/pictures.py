"""Pictures that we draw, as files that say that they are ours."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from echousd.stage.paths import component_file, thumbnail_file
from echousd.textures import encoded

if TYPE_CHECKING:
    from PIL import Image

MARK = ("Software", "echousd")  # text in our pictures, which other programs do not keep
HEAD = 2048  # bytes in which they say so
TENTH = 100  # milliseconds that a picture of several is shown


def png(picture: Image.Image) -> bytes:
    """A PNG of a picture, which says that it is ours."""
    from PIL.PngImagePlugin import PngInfo

    mark = PngInfo()
    mark.add_text(*MARK)
    return encoded(picture, pnginfo=mark, compress_level=2)  # in half the time of 4, for a tenth more bytes


def gif(pictures: Sequence[Image.Image]) -> bytes:
    """A GIF that shows pictures one after the other and begins again, and says that it is ours."""
    first, *rest = (picture.quantize(128) for picture in pictures)
    comment = MARK[1].encode()
    return encoded(first, "GIF", save_all=True, append_images=rest, duration=TENTH, loop=0, comment=comment)


def is_ours(path: Path) -> bool:
    """Whether a picture of any form says in its first bytes that it is ours; a PNG as its `Software`."""
    if not path.is_file():  # nobody waits for a pipe
        return False
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return False
    return ("\0".join(MARK) if head.startswith(b"\x89PNG") else MARK[1]).encode() in head


SIZE = 256  # pixels


def thumbnails(files: Mapping[str, bytes], names: Iterable[str]) -> dict[str, bytes]:
    """Path in the room's folder -> PNG of each asset that has none yet, in the plain colours that it has by itself.

    `files`: relative path -> content of the room's assets. `names`: of the assets. Raises RenderUnavailable (a
    ValueError) without the extra `render`.
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

    return encoded(render(asset, size=SIZE, rays=QUICK))
