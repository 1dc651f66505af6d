"""Meshes as texturing tools exchange them: Wavefront OBJ, and binary glTF of one material with images."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from trimesh.util import append_faces

from echomodel.bounded import read_bounded
from echomodel.files import telling
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
    with telling(path, "cannot be read"):
        return read_bounded(path, LARGEST)


def read_obj(path: Path) -> Unwrapped:
    """Triangles with texture coordinates from an OBJ; raises ValueError that names the file."""
    return _unwrapped(path, read_file(path), "obj", skip_materials=True)


def _unwrapped(path: Path, content: bytes, form: str, **how: Any) -> Unwrapped:
    """The triangles of all parts of a mesh's file, each vertex with its texture coordinate; raises ValueError."""
    try:
        scene: Any = trimesh.load_scene(io.BytesIO(content), file_type=form, process=False, **how)
        parts = [part for part in scene.dump() if isinstance(part, trimesh.Trimesh) and len(part.faces)]
        if not parts:
            raise ValueError("no triangles")
        laid = [st for part in parts if (st := getattr(part.visual, "uv", None)) is not None]
        if [len(st) for st in laid] != [len(part.vertices) for part in parts]:
            raise ValueError("a part without texture coordinates (TEXCOORD_0, vt)")
        points, faces = append_faces([part.vertices for part in parts], [np.asarray(part.faces, int) for part in parts])
        mesh = Unwrapped(points, np.concatenate(laid).astype(float), faces)
        if not (np.isfinite(mesh.points).all() and np.isfinite(mesh.st).all()):
            raise ValueError("numbers that are not finite")
    except ValueError as error:
        raise ValueError(f"{path}: {error}, allowed: triangles with texture coordinates") from None
    except Exception as error:  # a damaged file fails in every way there is
        raise ValueError(f"{path}: no {form} that can be read ({type(error).__name__}: {error!s:.80})") from None
    return mesh


MAX_COUNT = 20_000_000  # numbers in one array of a file
KNOWN = {"KHR_texture_transform"}  # extensions that a file may require and that are looked at
SLOTS = {"baseColorTexture": "color", "metallicRoughnessTexture": "metal_rough", "normalTexture": "normal"}


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


def read_glb(path: Path) -> tuple[Unwrapped, dict[str, bytes]]:
    """The triangles of a glb, and `color`, `metal_rough` (roughness in green, metal in blue) and `normal` -> image.

    Several primitives are one mesh if they have one material; node transforms are applied. Raises ValueError that names
    the file for a damaged one, several materials, images that cannot be read, compression, and links to other files.
    """
    content = read_file(path)
    tree = _checked(path, content)
    mesh = _unwrapped(path, content, "glb", merge_primitives=False)
    return mesh, _images(path, tree, content)


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
