"""Images that are none, too large or no files: refused in one line, at once, in little memory."""

from __future__ import annotations

import os
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from echousd import textures
from echousd.textures import TextureError, read_image


def png(width: int, height: int, rows: bytes = b"") -> bytes:
    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


BROKEN = {
    "empty": (b"", "0 bytes, allowed for an image: 1 to"),
    "text": (b"private notes", "not an image that can be read (of no known format)"),
    "cut": (png(64, 64)[:40], "not an image that can be read"),
    "bomb": (png(12_000, 12_000), "an image of 12000 x 12000 pixels, allowed: 67108864 (8192 x 8192)"),
    "huge": (png(2**31 - 1, 2**31 - 1), "too many pixels|an image of 2147483647|not an image"),
    "postscript": (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "of no known format"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_what_is_no_image_is_refused(tmp_path, kind):
    content, told = BROKEN[kind]
    path = tmp_path / f"{kind}.png"
    path.write_bytes(content)
    with pytest.raises(TextureError) as refused:
        read_image(str(path))
    assert str(path) in str(refused.value)
    assert any(part in str(refused.value) for part in told.split("|"))


def test_what_is_no_file_is_refused_and_what_is_not_there_is_grey(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    for path in (tmp_path / "pipe.png", "/dev/zero", tmp_path):
        with pytest.raises(TextureError, match="not a regular file, allowed: an image"):
            read_image(str(path))
    np.testing.assert_array_equal(read_image(str(tmp_path / "gone.png")), [[[188] * 3]])


def test_files_beyond_the_limit_are_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(textures, "MAX_BYTES", 100)
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (20, 20, 3), np.uint8)).save(tmp_path / "a.png")
    with pytest.raises(TextureError, match="bytes, allowed for an image: 1 to 100"):
        read_image(str(tmp_path / "a.png"))
