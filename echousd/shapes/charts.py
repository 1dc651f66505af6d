"""Texture coordinates of meshes by xatlas, in a process of its own.

xatlas may end the program that calls it (now and then, as its threads race), and comes to no end on damaged meshes.
This file is the other process as well: run by its path it imports nothing of ours, reads the arrays of an .npz on
stdin and writes those of another to stdout.
"""

import io
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import numpy as np

HERE = Path(__file__)
PATIENCE = 600.0  # seconds for all meshes of one call
TRIES = 3  # a race is seldom lost twice
NAMES = ("origin", "faces", "st")


def charts(
    pictures: Sequence[Sequence[tuple[np.ndarray, np.ndarray]]], resolution: int, padding: int
) -> list[tuple[np.ndarray, ...]]:
    """Lay meshes out in square pictures, charts apart from each other.

    Arguments:
        pictures: for each its meshes: (v, 3) points, in units of which xatlas leaves out triangles below 1e-7 square
            ones, and (f, 3) faces.
        resolution: texels along a picture's sides, roughly: charts may fill a part of it.
        padding: texels between charts.

    Returns for each mesh (n,) int which point each new one is, (f, 3) int the faces, of new points, in the old order,
    and (n, 2) float in [0, 1], where the new points lie.

    Raises ValueError where xatlas is not installed, ends its process again and again, or comes to no end.
    """
    if find_spec("xatlas") is None:
        raise ValueError('texture coordinates need xatlas: pip install "echousd[texture]"')
    boards = [board for meshes in pictures for board in meshes]
    arrays = {"options": np.array([resolution, padding]), "counts": np.array([len(meshes) for meshes in pictures])}
    for number, (points, faces) in enumerate(boards):
        arrays |= {f"points{number}": points.astype(np.float32), f"faces{number}": faces.astype(np.uint32)}
    sent = io.BytesIO()
    np.savez(sent, allow_pickle=False, **arrays)
    words, how = [sys.executable, "-P", str(HERE)], ""
    for _ in range(TRIES):
        try:
            done = subprocess.run(words, input=sent.getvalue(), capture_output=True, timeout=PATIENCE, check=False)
        except subprocess.TimeoutExpired:
            how = f"comes to no end in {PATIENCE:g} s"
            break
        if done.returncode == 0:
            with np.load(io.BytesIO(done.stdout), allow_pickle=False) as laid:
                return [tuple(laid[f"{name}{number}"] for name in NAMES) for number in range(len(boards))]
        how = f"ends the program ({done.returncode})"
    triangles = sum(len(faces) for _, faces in boards)
    raise ValueError(f"xatlas {how} over {triangles} triangles, allowed: meshes that it lays out")


def main() -> None:
    """Lay out the meshes on stdin."""
    import xatlas

    read = np.load(io.BytesIO(sys.stdin.buffer.read()), allow_pickle=False)
    laid, first = {}, 0
    for count in read["counts"]:
        atlas, pack = xatlas.Atlas(), xatlas.PackOptions()
        for number in range(first, first + count):
            atlas.add_mesh(read[f"points{number}"], read[f"faces{number}"])
        pack.resolution, pack.padding, pack.bilinear = *map(int, read["options"]), True
        atlas.generate(pack_options=pack)
        # Charts lie on texels of a picture that is seldom square; the square one has its longer side.
        sides = np.maximum([atlas.width, atlas.height], 1)
        for number in range(first, first + count):
            origin, faces, st = atlas[number - first]  # xatlas keeps the order of the faces
            laid[f"origin{number}"] = np.asarray(origin, int)
            laid[f"st{number}"] = np.asarray(st, float) * sides / sides.max()
            laid[f"faces{number}"] = np.asarray(faces, int).reshape(-1, 3)
        first += count
    np.savez(sys.stdout.buffer, allow_pickle=False, **laid)


if __name__ == "__main__":
    main()
