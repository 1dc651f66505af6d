"""Meshes as texturing tools exchange them: Wavefront OBJ, and binary glTF of one material with images."""

from __future__ import annotations

import io
import json
import stat
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

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


MAX_COUNT = 20_000_000  # numbers in one array of a file
KNOWN = {"KHR_texture_transform"}  # extensions that a file may require and that are looked at
SLOTS = {"baseColorTexture": "color", "metallicRoughnessTexture": "metal_rough", "normalTexture": "normal"}


@dataclass(frozen=True, eq=False)
class PaintedMesh:
    """What a tool gave back: triangles with texture coordinates, and images by what they are.

    Arguments:
        mesh: the triangles of all primitives.
        images: `color`, `metal_rough` (roughness in green, metal in blue) and `normal` -> the encoded image.
    """

    mesh: Unwrapped
    images: Mapping[str, bytes] = field(default_factory=dict)


def glb_bytes(mesh: Unwrapped, name: str, color: Any = None) -> bytes:
    """A mesh as glb with a plain material, or with `color`, a PIL image, as its base colour."""
    material = trimesh.visual.material.PBRMaterial(
        name=name, baseColorFactor=[0.8, 0.8, 0.8, 1.0], metallicFactor=0.0, roughnessFactor=0.8, baseColorTexture=color
    )
    visual = trimesh.visual.TextureVisuals(uv=mesh.st, material=material)
    shape = trimesh.Trimesh(mesh.points, mesh.faces, visual=visual, process=False)
    scene = trimesh.Scene()
    scene.add_geometry(shape, node_name=name, geom_name=name)
    return bytes(scene.export(file_type="glb"))


def read_glb(path: Path) -> PaintedMesh:
    """The triangles and images of a glb.

    Several primitives are one mesh if they have one material; node transforms are applied. Raises ValueError that names
    the file for a damaged one, several materials, images that cannot be read, compression, and links to other files.
    """
    content = read_file(path)
    tree = _checked(path, content)
    try:
        scene: Any = trimesh.load(io.BytesIO(content), file_type="glb", process=False, merge_primitives=False)
        parts = [scene] if isinstance(scene, trimesh.Trimesh) else list(scene.dump())
        parts = [part for part in parts if isinstance(part, trimesh.Trimesh) and len(part.faces)]
        if not parts:
            raise ValueError("no triangles")
        points, st, faces, count = [], [], [], 0
        for part in parts:
            laid = getattr(part.visual, "uv", None)
            if laid is None or len(laid) != len(part.vertices):
                raise ValueError("a primitive without texture coordinates (TEXCOORD_0)")
            points.append(np.asarray(part.vertices, float))
            st.append(np.asarray(laid, float))
            faces.append(np.asarray(part.faces, int) + count)
            count += len(points[-1])
        mesh = Unwrapped(np.concatenate(points), np.concatenate(st), np.concatenate(faces))
        if not (np.isfinite(mesh.points).all() and np.isfinite(mesh.st).all()):
            raise ValueError("numbers that are not finite")
    except ValueError as error:
        raise ValueError(f"{path}: {error}, allowed: triangles with texture coordinates") from None
    except Exception as error:  # a damaged file fails in every way there is
        raise ValueError(f"{path}: not a glb that can be read ({type(error).__name__})") from None
    return PaintedMesh(mesh, _images(path, tree, content))


def _images(path: Path, tree: dict[str, Any], content: bytes) -> dict[str, bytes]:
    """Images of the only material, as they lie in the file: painted looks keep their bytes."""
    material = (tree.get("materials") or [{}])[0]
    slots = {**material.get("pbrMetallicRoughness", {}), **material}
    begin = struct.unpack_from("<I", content, 12)[0] + 28  # of the binary chunk's content
    found = {}
    for slot in SLOTS.keys() & {key for key, value in slots.items() if value is not None}:
        try:
            view = tree["bufferViews"][tree["images"][tree["textures"][slots[slot]["index"]]["source"]]["bufferView"]]
            start, size = begin + int(view.get("byteOffset", 0)), int(view["byteLength"])
        except (KeyError, IndexError, TypeError, ValueError):
            raise ValueError(f"{path}: {slot} names no image of the file") from None
        if not begin <= start < start + size <= len(content):
            raise ValueError(f"{path}: {slot} lies outside of the file")
        found[SLOTS[slot]] = content[start : start + size]
    return found


def _checked(path: Path, content: bytes) -> dict[str, Any]:
    """What the file says of itself; what is not of this file alone, or larger than anything real, is refused."""
    try:
        magic, version, _, length, kind = struct.unpack_from("<4sIIII", content)
        tree = json.loads(content[20 : 20 + length])
        needed = set(tree.get("extensionsRequired", ())) - KNOWN
        named = [(what, each) for what in ("buffers", "images") for each in tree.get(what, ())]
        outside = [(what, each["uri"]) for what, each in named if "uri" in each]
        accessors = [(each.get("count"), "sparse" in each) for each in tree.get("accessors", ())]
        used = {each.get("material") for mesh in tree.get("meshes", ()) for each in mesh.get("primitives", ())}
        if magic != b"glTF" or version != 2 or kind != 0x4E4F534A:
            raise ValueError
    except (ValueError, TypeError, AttributeError, struct.error, RecursionError):
        raise ValueError(f"{path}: not a binary glTF 2.0 file") from None
    if needed:
        raise ValueError(f"{path}: needs {', '.join(sorted(map(str, needed)))}, allowed: uncompressed glTF")
    for what, name in outside:
        raise ValueError(f"{path}: {what} name {str(name)!r:.80}, allowed: what is in the file itself")
    for count, sparse in accessors:
        if type(count) is not int or not 0 <= count <= MAX_COUNT or sparse:
            raise ValueError(f"{path}: an accessor counts {count!r:.40}, allowed: 0 to {MAX_COUNT}, not sparse")
    if len(used) > 1:
        raise ValueError(f"{path}: {len(used)} materials, allowed: one for the whole object")
    return tree
