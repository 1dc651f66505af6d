"""Wavefront OBJ as texturing tools exchange it: triangles with one texture coordinate a vertex, one material."""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np

from echousd.texturing.atlas import DIGITS, Unwrapped

LARGEST = 256 * 2**20  # bytes of a mesh that is read


def obj_bytes(mesh: Unwrapped, name: str, *, material: bool = True) -> bytes:
    """The mesh as OBJ; every vertex has its texture coordinate, so that both are counted alike."""
    lines = [f"# {name}: +Y up, -Z forward, metres"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.points.tolist()]
    lines += [f"vt {u:.{DIGITS}f} {v:.{DIGITS}f}" for u, v in mesh.st.tolist()]
    lines += [f"o {name}"] + ([f"usemtl {name}"] if material else [])
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in (mesh.faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()


def read_file(path: Path) -> bytes:
    """The bytes of a mesh's file; raises ValueError for what is no regular file, or larger than `LARGEST`."""
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            raise ValueError(f"{path}: not a regular file, allowed: a mesh")
        if found.st_size > LARGEST:
            raise ValueError(f"{path}: {found.st_size} bytes, allowed for a mesh: {LARGEST}")
        return path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror or error})") from None


def read_obj(path: Path) -> Unwrapped:
    """Triangles with texture coordinates from an OBJ; raises ValueError that names the file and the line."""
    points: list[list[float]] = []
    st: list[list[float]] = []
    corners: list[tuple[int, int]] = []
    for number, line in enumerate(read_file(path).decode("utf-8", "replace").splitlines(), 1):
        word, _, rest = line.partition(" ")
        if word not in ("v", "vt", "f"):
            continue
        fields = rest.split()
        try:
            if word == "f":
                if len(fields) != 3:
                    raise ValueError(f"a face of {len(fields)} corners, allowed: 3 (triangulate it)")
                corners += [_corner(field, len(points), len(st)) for field in fields]
            else:
                (points if word == "v" else st).append([float(field) for field in fields[: 3 if word == "v" else 2]])
        except ValueError as error:
            raise ValueError(f"{path}: line {number}: {error}") from None
    if not corners:
        raise ValueError(f"{path}: no faces, allowed: triangles with texture coordinates")
    try:
        places, laid = np.array(points, float).reshape(-1, 3), np.array(st, float).reshape(-1, 2)
    except ValueError:
        raise ValueError(f"{path}: a vertex has too few numbers, allowed: 3, and 2 for texture coordinates") from None
    if not (np.isfinite(places).all() and np.isfinite(laid).all()):
        raise ValueError(f"{path}: numbers that are not finite, allowed: metres and coordinates from 0 to 1")
    pairs, index = np.unique(np.array(corners), axis=0, return_inverse=True)
    return Unwrapped(places[pairs[:, 0]], laid[pairs[:, 1]], index.reshape(-1, 3))


def _corner(field: str, points: int, st: int) -> tuple[int, int]:
    """(point, texture coordinate) of `12/7` or `12/7/3`, counted from 0."""
    parts = field.split("/")
    if len(parts) < 2 or not parts[1]:
        raise ValueError(f"corner {field!r:.40} has no texture coordinate, allowed: point/coordinate")
    out = []
    for part, count in ((parts[0], points), (parts[1], st)):
        index = int(part)
        index = index - 1 if index > 0 else count + index
        if not 0 <= index < count:
            raise ValueError(f"corner {field!r:.40} names number {part}, allowed: 1 to {count}")
        out.append(index)
    return out[0], out[1]
