"""Images that stages name: read with doubt, as a stage may name anything."""

from __future__ import annotations

import io
import stat
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Ar

from echomodel.files import within_memory

if TYPE_CHECKING:
    from PIL.Image import Image

MAX_BYTES = 256 * 2**20
MAX_PIXELS = 8192 * 8192
# Pillow would also run Ghostscript for EPS; these it decodes itself.
FORMATS = ("PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF", "AVIF")
READABLE = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".webp", ".gif", ".avif")
STRIP = 256  # rows
GREY = 188  # sRGB of what is not there


class TextureError(ValueError):
    """A file that is no image that can be read; the message names it, what was found and what is allowed."""


def file_of(path: str) -> Path:
    """The file on disk that holds an asset: the path itself, or the outermost package of `room.usdz[image.png]`."""
    return Path(Ar.SplitPackageRelativePathOuter(path)[0])


def texture_bytes(path: str) -> bytes | None:
    """Content of an asset at a resolved path, from a folder or from inside a usdz; None where there is none.

    Raises TextureError for what is no regular file (a pipe would wait for ever), empty or larger than `MAX_BYTES`.
    """
    try:
        found = file_of(path).stat()
    except (OSError, ValueError):
        return None
    if not stat.S_ISREG(found.st_mode):
        raise TextureError(f"{path}: not a regular file, allowed: an image")
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if not asset:
        return None
    size = asset.GetSize()
    if not 0 < size <= MAX_BYTES:
        raise TextureError(f"{path}: {size} bytes, allowed for an image: 1 to {MAX_BYTES}")
    return bytes(asset.GetBuffer())


def read_image(path: str, halved: int = 0) -> np.ndarray:
    """(h, w, 3) uint8 sRGB of the image at a resolved path; one grey pixel where there is no file.

    `halved`: how often its sides are halved; of a JPEG, at most thrice, that makes reading it quicker. Raises
    TextureError for what `texture_bytes` refuses, what is no image, and more than `MAX_PIXELS` pixels.
    """
    content = texture_bytes(path)
    return np.full((1, 1, 3), GREY, np.uint8) if content is None else decoded(content, path, halved)


def decoded(content: bytes, path: str, halved: int = 0) -> np.ndarray:
    """(h, w, 3) uint8 sRGB of an encoded image; raises TextureError, which calls it `path`, as `read_image` does."""
    from PIL import Image

    with image_in(content, path) as image:
        width, height = image.size
        image.draft(None, (max(width >> halved, 1), max(height >> halved, 1)))
        many = 2**halved * image.width // width  # that are left to be one
        return _rgb(image) if many < 2 else np.asarray(Image.fromarray(_rgb(image)).reduce(many))


@contextmanager
def image_in(content: bytes, path: str) -> Iterator[Image]:
    """An encoded image, which the block decodes; raises TextureError, which calls it `path`, for what is none."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # our own limit is below
        try:
            with (
                within_memory(Path(path), path, size=len(content)),
                Image.open(io.BytesIO(content), formats=FORMATS) as image,
            ):
                if image.width * image.height > MAX_PIXELS:
                    found = f"{image.width} x {image.height} pixels"
                    raise TextureError(f"{path}: an image of {found}, allowed: {MAX_PIXELS} (8192 x 8192)")
                yield image
        except TextureError:
            raise
        except Image.DecompressionBombError:
            raise TextureError(f"{path}: an image of too many pixels, allowed: {MAX_PIXELS} (8192 x 8192)") from None
        except Exception as error:  # decoders fail on damaged files in every way there is
            reason = str(error) if not isinstance(error, Image.UnidentifiedImageError) else "of no known format"
            raise TextureError(f"{path}: not an image that can be read ({reason or type(error).__name__})") from None


def encoded(picture: Image, form: str = "PNG", **how: Any) -> bytes:
    """A picture as a file of a form; `how`: as Pillow's writer of that form takes it."""
    out = io.BytesIO()
    picture.save(out, form, **{"compress_level": 4} | how)  # PNG's 6 takes three times as long, for 4 % fewer bytes
    return out.getvalue()


def _rgb(image: Image) -> np.ndarray:
    """(h, w, 3) uint8 of an image, converted a strip at a time: a second copy of a large one is not held."""
    image.load()
    out = np.empty((image.height, image.width, 3), np.uint8)
    for top in range(0, image.height, STRIP):
        strip = image if image.height <= STRIP else image.crop((0, top, image.width, min(top + STRIP, image.height)))
        out[top : top + STRIP] = np.asarray(strip if strip.mode == "RGB" else strip.convert("RGB"))
    return out
