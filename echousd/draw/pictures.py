"""Pictures that we draw, as files that say that they are ours."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

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
