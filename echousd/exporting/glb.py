"""Binary glTF of a stage: a node for every Xform, with its meshes, cameras and lights and what the graph says.

Images go in as they are on disk, equal arrays once; trimesh's exporter would encode each image anew for each material,
and knows neither lights nor several materials in one mesh.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from echousd.draw.drawables import Drawable, Paint, Texture, image_of, own_category, read_drawables
from echousd.exporting.packing import Reach
from echousd.stage import values
from echousd.stage.lights import emitted
from echousd.stage.read import facts, find_rooms, node_names, room_spec
from echousd.stage.showing import selected_layout
from echousd.stage.units import to_metres
from echousd.textures import encoded, texture_bytes

ENCODED = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg"}  # what glTF takes, by how it begins
COMPONENT = {"f": 5126, "H": 5123, "I": 5125}
VERTICES, INDICES = 34962, 34963
Shown = tuple[Paint, bool]  # a material, and whether both sides show it


def object_glb(stage: Usd.Stage, room: Sdf.Path, path: Sdf.Path) -> bytes:
    """One object of a room, which lies at `room`, in its own frame."""
    alone = Usd.Stage.OpenMasked(stage.GetRootLayer(), Usd.StagePopulationMask([path, room.AppendChild("Looks")]))
    with Usd.EditContext(alone, alone.GetSessionLayer()):
        UsdGeom.Xformable(alone.GetPrimAtPath(path)).SetXformOpOrder([], True)
    return glb(alone, Reach.of(alone, ()))


def glb(stage: Usd.Stage, reach: Reach) -> bytes:
    """Y up, metres; images within reach.

    Lights keep the stage's scale, in which a white surface under an irradiance of pi is 1, as candela and lux: a viewer
    at exposure 1 shows them as other renderers show the stage. A dome has no counterpart in glTF and is left out; a
    panel is a spot that shines to all of its front.

    Raises StageError for images out of reach or that cannot be read, ValueError for a stage without a visible mesh.
    """
    tree = _Tree(stage, reach)
    parts: dict[int, dict[Shown, list[np.ndarray]]] = {}
    for mesh in read_drawables(stage):
        index = tree.node_of(mesh)
        for paint, corners in _corners(mesh, tree.worlds[index]):
            parts.setdefault(index, {}).setdefault((paint, mesh.double_sided), []).append(corners)
    if not parts:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to export, found no visible mesh")
    for index, shown in parts.items():
        tree.add_mesh(index, shown)
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        image = UsdGeom.Imageable(prim)
        if image and image.ComputeVisibility(values.NOW) != UsdGeom.Tokens.invisible:
            tree.add_view_or_light(prim)
    for room in find_rooms(stage):
        names = node_names(room)
        relations = [{"subject": r.subject, "predicate": r.predicate, "object": r.object} for r in facts(room, names)]
        extras = {"roomType": room_spec(room).type, "relations": relations}
        tree.extras(
            tree.node(room.room), extras | ({"layout": selected_layout(stage)} if selected_layout(stage) else {})
        )
    return tree.encoded()


class _Tree:
    """A glTF file as it grows; `stage`: what is written, `reach`: where its images may lie."""

    def __init__(self, stage: Usd.Stage, reach: Reach) -> None:
        self.stage, self.reach = stage, reach
        self.worlds: list[np.ndarray] = []  # of every node, (4, 4) float
        self.tables: dict[str, list[dict[str, Any]]] = {}
        self.lights: list[dict[str, Any]] = []
        self.extensions: set[str] = set()
        self.roots: list[int] = []
        self.binary = bytearray()
        self.frame = to_metres(self.stage)
        self.cache = UsdGeom.XformCache(values.NOW)
        self.known: dict[Any, int] = {}  # what is there already -> its index

    def add(self, table: str, entry: dict[str, Any], key: Any = None) -> int:
        """Index of an entry of a table; one with the same key stands there once."""
        whole = (table, json.dumps(entry, sort_keys=True) if key is None else key)
        if whole not in self.known:
            self.known[whole] = len(self.tables.setdefault(table, []))
            self.tables[table].append(entry)
        return self.known[whole]

    def node(self, prim: Usd.Prim) -> int:
        """Index of the node of a prim, made with those of the Xforms above it."""
        path = str(prim.GetPath())
        if path in self.known:
            return self.known[path]
        above = next((each for each in values.lineage(prim.GetParent()) if each.IsA(UsdGeom.Xform)), None)
        parent = None if above is None else self.node(above)
        world = self.frame @ values.matrix(self.cache.GetLocalToWorldTransform(prim), prim)
        if prim.IsA(UsdGeom.Camera) or prim.HasAPI(UsdLux.LightAPI):  # which no scale changes
            length = np.linalg.norm(world[:3, :3], axis=0)
            world[:3, :3] /= np.where(length > 0, length, 1.0)
        if prim.IsA(UsdGeom.Camera):
            world[:3, :3] = world[:3, :3] @ _turned(UsdGeom.Camera(prim).GetCamera())
        index = self._new(path, prim.GetName(), world, parent)
        if own_category(prim):
            self.extras(index, {"id": path, "category": own_category(prim)})
        return index

    def node_of(self, mesh: Drawable) -> int:
        """Index of the node that a mesh is part of: of the closest Xform, of an instance, else its own."""
        path, bracket, _ = mesh.path.partition("]")
        if bracket:
            if path not in self.known:
                instancer = self.stage.GetPrimAtPath(path.rpartition("[")[0])
                self._new(path, mesh.component, mesh.world, self.node(instancer))
                self.extras(self.known[path], {"id": f"{path}]", "category": mesh.category})
            return self.known[path]
        prim = self.stage.GetPrimAtPath(mesh.path)
        return self.node(next((each for each in values.lineage(prim) if each.IsA(UsdGeom.Xform)), prim))

    def _new(self, key: str, name: str, world: np.ndarray, parent: int | None) -> int:
        local = world
        if parent is not None:
            try:
                local = np.linalg.inv(self.worlds[parent]) @ world
            except np.linalg.LinAlgError:  # of no size, which nothing below it can undo
                parent = None
        entry: dict[str, Any] = {"name": name}
        if not np.allclose(local, np.eye(4), atol=1e-9):
            entry["matrix"] = [round(float(v), 9) + 0.0 for v in local.T.ravel()]
        index = self.known[key] = len(self.worlds)
        self.tables.setdefault("nodes", []).append(entry)
        self.worlds.append(world)
        if parent is None:
            self.roots.append(index)
        else:
            self.tables["nodes"][parent].setdefault("children", []).append(index)
        return index

    def extras(self, index: int, found: Mapping[str, Any]) -> None:
        """Add to what a node says of itself."""
        self.tables["nodes"][index].setdefault("extras", {}).update(found)

    def add_mesh(self, index: int, shown: Mapping[Shown, list[np.ndarray]]) -> None:
        """The mesh of a node: a primitive for each material."""
        primitives = []
        for (paint, double), parts in shown.items():
            rows, corner = np.unique(_rows(np.concatenate(parts)), return_inverse=True)
            table = rows.view(np.float32).reshape(-1, 8)
            attributes = {"POSITION": table[:, :3], "NORMAL": table[:, 3:6]}
            material = self._material(paint, double)
            if paint.textured:  # coordinates that nothing reads are left out
                attributes["TEXCOORD_0"] = table[:, 6:] * (1, -1) + (0, 1)
            wide = np.uint16 if len(table) < 2**16 - 1 else np.uint32
            primitives.append(
                {
                    "attributes": {name: self._accessor(part, VERTICES) for name, part in attributes.items()},
                    "indices": self._accessor(corner.reshape(-1, 1).astype(wide), INDICES),
                    "material": material,
                }
            )
        key = json.dumps(primitives, sort_keys=True)  # of equal pieces there is one mesh
        node = self.tables["nodes"][index]
        node["mesh"] = self.add("meshes", {"name": node["name"], "primitives": primitives}, key)

    def _accessor(self, array: np.ndarray, target: int) -> int:
        array = np.ascontiguousarray(array, np.float32 if array.dtype.kind == "f" else array.dtype)
        entry = {
            "bufferView": self._view(array.tobytes(), target),
            "componentType": COMPONENT[array.dtype.char],
            "count": len(array),
            "type": f"VEC{array.shape[1]}" if array.shape[1] > 1 else "SCALAR",
        }
        if array.shape[1] == 3:  # asked for of positions
            entry |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        return self.add("accessors", entry)

    def _view(self, content: bytes, target: int | None = None) -> int:
        key = (content, target)
        if ("bufferViews", key) not in self.known:
            self.binary += bytes(-len(self.binary) % 4)
            start = len(self.binary)
            self.binary += content
            entry = {"buffer": 0, "byteOffset": start, "byteLength": len(content)}
            self.add("bufferViews", entry | ({"target": target} if target else {}), key)
        return self.known["bufferViews", key]

    def _material(self, paint: Paint, double: bool) -> int:
        if ("materials", (paint, double)) in self.known:
            return self.known["materials", (paint, double)]
        tint = paint.tint if paint.texture else paint.color
        color = [float(np.clip(c, 0.0, 1.0)) for c in (*tint, paint.opacity)]
        rough: dict[str, Any] = {"metallicFactor": float(np.clip(paint.metallic, 0.0, 1.0))}
        rough["roughnessFactor"] = float(np.clip(paint.rough.scale if paint.rough else paint.roughness, 0.0, 1.0))
        if color != [1.0, 1.0, 1.0, 1.0]:
            rough["baseColorFactor"] = color
        entry: dict[str, Any] = {"name": paint.name, "pbrMetallicRoughness": rough}
        if paint.texture:
            rough["baseColorTexture"] = self._texture(Texture(paint.texture, paint.image))
        if paint.rough:
            rough["metallicRoughnessTexture"] = self._texture(paint.rough, metal=paint.metallic > 0)
        if paint.normal:
            entry["normalTexture"] = self._texture(paint.normal)
        strength = max(paint.emissive)
        if strength > 0:
            entry["emissiveFactor"] = [c / max(strength, 1.0) for c in paint.emissive]
        if strength > 1:
            entry["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
            self.extensions.add("KHR_materials_emissive_strength")
        if paint.opacity < 1:
            entry["alphaMode"] = "BLEND"
        if double:
            entry["doubleSided"] = True
        return self.add("materials", entry, (paint, double))

    def _texture(self, texture: Texture, metal: bool | None = None) -> dict[str, int]:
        """Reference to an image; with `metal` to its roughness in green and, in blue, what metal there is."""
        from PIL import Image

        key = (texture, metal)
        if ("images", key) not in self.known:
            self.reach.check(texture.path, f"<{texture.prim}>")
            pixels = image_of(texture.prim, texture.path)  # refused here if it cannot be read
            content = texture_bytes(texture.path) or b""
            kind = next((kind for start, kind in ENCODED.items() if content.startswith(start)), "")
            if metal is not None and (metal or not _is_grey(pixels)):
                grey = pixels[..., "rgb".index(texture.channel)]
                pixels, kind = np.stack([grey * 0, grey, grey * 0 + 255], -1), ""
            if not kind:
                content, kind = encoded(Image.fromarray(pixels)), "image/png"
            self.add("images", {"bufferView": self._view(content), "mimeType": kind}, key)
        image = self.known["images", key]
        return {"index": self.add("textures", {"source": image})}

    def add_view_or_light(self, prim: Usd.Prim) -> None:
        """The node of a camera or a light; nothing for other prims, and for what glTF cannot say."""
        if prim.IsA(UsdGeom.Camera):
            camera = _camera(UsdGeom.Camera(prim).GetCamera(), abs(float(self.frame[0, 0])))
            if camera:
                self.tables["nodes"][self.node(prim)]["camera"] = self.add("cameras", camera)
        elif prim.HasAPI(UsdLux.LightAPI):
            light = _light(prim, abs(float(self.frame[0, 0])))
            if light:
                extensions = {"KHR_lights_punctual": {"light": len(self.lights)}}
                self.tables["nodes"][self.node(prim)]["extensions"] = extensions
                self.lights.append({"name": prim.GetName(), **light})
                self.extensions.add("KHR_lights_punctual")

    def encoded(self) -> bytes:
        """The file."""
        self.binary += bytes(-len(self.binary) % 4)
        tree: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "EchoUSD"},
            "scene": 0,
            "scenes": [{"nodes": self.roots}],
            **self.tables,
            "buffers": [{"byteLength": len(self.binary)}],
        }
        if self.extensions:
            tree["extensionsUsed"] = sorted(self.extensions)
        if self.lights:
            tree["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        text = json.dumps(tree, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.binary))
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(self.binary), b"BIN\0")
        return head + chunks + bytes(self.binary)


def _corners(mesh: Drawable, node: np.ndarray) -> list[tuple[Paint, np.ndarray]]:
    """Materials of a mesh with the corners that show them, (k, 8) float32: place in the node's frame, normal, st."""
    try:
        inside = np.round(np.linalg.inv(node) @ mesh.world, 9)
        turn = np.linalg.inv(inside[:3, :3]).T
    except np.linalg.LinAlgError:  # flat
        inside, turn = np.eye(4), np.eye(3)
    points = mesh.triangles @ inside[:3, :3].T + inside[:3, 3]
    normals = mesh.normals @ turn.T
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    st = np.zeros((*points.shape[:2], 2)) if mesh.st is None else mesh.st
    corners = np.concatenate([points, normals, st], -1).astype(np.float32)
    if np.linalg.det(inside[:3, :3]) < 0:
        corners = corners[:, ::-1]
    owner = np.zeros(len(corners), int)
    for number, (_, faces) in enumerate(mesh.paints):  # later ones win
        owner[faces] = number
    found = [(paint, corners[owner == number].reshape(-1, 8)) for number, (paint, _) in enumerate(mesh.paints)]
    for paint, part in found:
        if not paint.textured:
            part[:, 6:] = 0.0  # not to tell corners apart by what is not written
    return [(paint, part) for paint, part in found if len(part)]


def _rows(corners: np.ndarray) -> np.ndarray:
    """Each row of (k, 8) float32 as one value that compares as a whole; -0 is 0."""
    return np.ascontiguousarray(corners + np.float32(0.0)).view(np.dtype((np.void, 32))).ravel()


def _is_grey(pixels: np.ndarray) -> bool:
    wide = pixels.astype(np.int16)
    return all(np.abs(wide[..., k] - wide[..., k - 1]).max(initial=0) <= 3 for k in range(3))  # JPEG rounds


def _camera(found: Gf.Camera, metres: float) -> dict[str, Any] | None:
    """A camera in glTF's words; None where its numbers make no picture."""
    near, far = found.clippingRange.min * metres, found.clippingRange.max * metres
    aspect, fov = found.aspectRatio, np.radians(found.GetFieldOfView(Gf.Camera.FOVVertical))
    if not (np.isfinite([near, far, aspect, fov]).all() and 0 < near < far and aspect > 0 and 0 < fov < np.pi):
        return None
    if found.projection == Gf.Camera.Perspective:
        lens = {"yfov": float(fov), "aspectRatio": aspect, "znear": near, "zfar": far}
        return {"type": "perspective", "perspective": lens}
    half = 0.5 * Gf.Camera.APERTURE_UNIT * metres
    lens = {"xmag": found.horizontalAperture * half, "ymag": found.verticalAperture * half, "znear": near, "zfar": far}
    return {"type": "orthographic", "orthographic": lens}


def _turned(found: Gf.Camera) -> np.ndarray:
    """(3, 3) by which a lens that has no shift, as in glTF, turns to the middle of what a shifted one sees."""
    turn = np.eye(3)
    if found.projection == Gf.Camera.Perspective and found.focalLength > 0:
        for axes, shift, film in (
            ([1, 2], found.verticalApertureOffset, found.verticalAperture),
            ([0, 2], found.horizontalApertureOffset, found.horizontalAperture),
        ):
            ends = np.arctan((shift + np.array([-film, film]) / 2) / found.focalLength)
            cos, sin = np.cos(ends.mean()), np.sin(ends.mean())
            once = np.eye(3)
            once[np.ix_(axes, axes)] = (cos, -sin), (sin, cos)
            turn = once @ turn
    return turn


def _light(prim: Usd.Prim, metres: float) -> dict[str, Any] | None:
    """A light in the words of KHR_lights_punctual; None for one that is out, and for kinds that it does not know."""

    color = emitted(prim, metres)
    kind: dict[str, Any]
    if prim.IsA(UsdLux.DistantLight):
        kind, share = {"type": "directional"}, 1.0
    elif prim.IsA(UsdLux.SphereLight):
        kind, share = {"type": "point"}, 0.25  # of its surface is seen from anywhere
    elif prim.IsA(UsdLux.RectLight) or prim.IsA(UsdLux.DiskLight):
        kind, share = {"type": "spot", "spot": {"outerConeAngle": np.pi / 2}}, 1.0
    else:
        return None
    intensity = color.max() * share
    if not (np.isfinite(color).all() and intensity > 0):
        return None
    return kind | {"color": [round(float(c), 6) for c in color / color.max()], "intensity": round(float(intensity), 6)}
