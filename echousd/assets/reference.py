"""How graphs and options refer to models of other people: by an id in a library, or a file and a prim in it."""

import os
from collections.abc import Sequence
from pathlib import Path

from echousd.naming import STAGE_FORMS

MODELS = (*STAGE_FORMS, ".obj", ".glb", ".gltf")
Vector = tuple[float, float, float]


def is_file(asset: str) -> bool:
    """Whether a node's `asset` is the file of a model, and not the id of one in a library."""
    return Path(split(asset)[0]).suffix.lower() in MODELS


def split(asset: str) -> tuple[str, str]:
    """(file, prim path) of `kitchen.usda</World/Sofa>`, the path empty where none is told."""
    file, angle, prim = asset.partition("<")
    return (file, prim.removesuffix(">")) if angle and prim.endswith(">") else (asset, "")


def joined(file: str, prim: str) -> str:
    """The inverse of `split`."""
    return f"{file}<{prim}>" if prim else file


def relative(path: Path, library: Path) -> str:
    """A path as it is stored: relative to the index's folder where that can be said, with forward slashes."""
    here = library.absolute().parent
    try:
        return Path(os.path.relpath(path.absolute(), here)).as_posix()
    except ValueError:  # on another drive
        return path.absolute().as_posix()


def check_reach(path: Path, folder: Path, outside: Sequence[Path], entry: str) -> None:
    """Raises ValueError for a file or folder that a graph or an index names in none of the folders that it may.

    Arguments:
        path: what is named. folder: that of the graph or index. outside: those that the caller allows besides.
        entry: what the error calls the place that names it. Links are followed in all of them.
    """
    real = os.path.realpath(path)
    for place in (folder, *outside):
        if os.path.commonpath([top := os.path.realpath(place), real]) == top:
            return
    raise ValueError(f"{entry} names {real}, allowed: files below {folder} (--allow-outside DIR adds a folder)")
