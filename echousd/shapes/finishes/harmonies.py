"""Harmonies: colours of wall, floor, wood, cloth and accents that go together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from echousd.srgb import of_hexadecimal

Color = tuple[float, float, float]


class Harmony(NamedTuple):
    """Colours as sRGB hex; style groups of one room take turns with `wood` and `wood2`, `cloth` and `cloth2`."""

    wall: str
    floor: str
    wood: str
    wood2: str
    front: str
    cloth: str
    cloth2: str
    linen: str
    blanket: str
    metal: str
    ceramic: str
    accent: str
    rug: str
    curtain: str


HARMONIES: Mapping[str, Harmony] = {
    name: Harmony(*row.split())
    for name, row in {
        "oak": "e9e5dc c8a67c b98f5f 8a6a48 e7e1d6 7d8b91 c9bfae ece7dd 8c9ba0 33353a d9d3c7 c47f4f d8cfc0 e6e0d4",
        "walnut": "ece4d6 a97e55 77502f b08458 8a6240 b9803a 5f6b5a efe8da b06a43 b08d57 b9623f 2f4a4d c9b79c ddcfb8",
        "ash": "e6e8e0 d6bd95 d3b88f a98f6d f0ece3 a9b39c dcd6c8 f3efe7 8fa08a d0cfca 8d9a92 d9a05b e2ddd0 eeeae0",
        "smoke": "dfe1e3 9a8673 7d6b5b b7a48e 9a8c7f 5d7088 b9bcc0 dfdcd6 3f4f66 9ea3a8 3c4046 c9893f c3c5c6 d3d5d6",
        "cherry": "efe8dc b98d63 83523a c49a6c 9a6446 c9b594 6a3f3a f0e9de 93443a c2a15f e4ddd0 4a5d4f b98a72 e9dcc8",
        "birch": "f0ebe4 dcc39a dcc39a b48f63 cfd8d3 c48f85 dbcfc4 f5f0ea d5a79c 8e9498 c9b8a6 6f8f8b e6d8cd f1e8e0",
        "coast": "eef0ee d9c4a0 c9ad80 8f9aa0 f2f1ec 6f93a6 d9d4c6 f4f2ec 3f6b82 c5c9cb eae6dc e0b45c cfd9da f0efe9",
        "forest": "e3e2d6 a88661 9b744c 5f4632 4f5f4c 5b7058 c7b894 ebe6d8 74532f 4a453c 8f8a6e c0673a b8ad8c d8d3bf",
        "clay": "efe2d6 c19b75 a9764d d9bd97 d8b9a0 b9694b e3d3bf f3e9dd 8d4a36 3e3833 cf9b7a 4f6a6d d9b79d f0e2d2",
        "ink": "e2e3e6 8d7358 4a3a30 a98560 2f3742 34435a a79a88 e8e6e1 22304a b89a5e d6d2ca b8862f 8f97a3 5b6677",
    }.items()
}


def linear(hexadecimal: str) -> Color:
    """`b98f5f` (sRGB) -> linear RGB."""
    red, green, blue = (round(float(v), 5) for v in of_hexadecimal(hexadecimal))
    return red, green, blue


def mixed(first: str, second: str, share: float) -> Color:
    """Linear RGB of two sRGB colours mixed in linear light, `share` of the second."""
    mix = (1 - share) * np.array(linear(first)) + share * np.array(linear(second))
    red, green, blue = (round(float(v), 5) for v in mix)
    return red, green, blue
