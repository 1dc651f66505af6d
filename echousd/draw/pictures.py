"""Pictures that we draw, as files that say that they are ours."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL import Image

MARK = ("Software", "echousd")  # text in our pictures, which other programs do not keep
TENTH = 100  # milliseconds that a picture of several is shown


def png(picture: Image.Image) -> bytes:
    """A PNG of a picture, which says that it is ours."""
    from PIL.PngImagePlugin import PngInfo

    buffer, mark = io.BytesIO(), PngInfo()
    mark.add_text(*MARK)
    picture.save(buffer, "PNG", pnginfo=mark)
    return buffer.getvalue()


def gif(pictures: Sequence[Image.Image]) -> bytes:
    """A GIF that shows pictures one after the other and begins again, and says that it is ours."""
    buffer, small = io.BytesIO(), [picture.quantize(128) for picture in pictures]
    comment = MARK[1].encode()
    small[0].save(buffer, "GIF", save_all=True, append_images=small[1:], duration=TENTH, loop=0, comment=comment)
    return buffer.getvalue()


def is_ours(path: Path) -> bool:
    """Whether a file is a PNG that says that it is ours."""
    from PIL import Image

    try:
        with Image.open(path) as picture:
            return picture.info.get(MARK[0]) == MARK[1]
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return False
