"""A glb as its JSON says it, read without the code that writes it."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

WORDS = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}


@dataclass(frozen=True)
class Gltf:
    """The tables, and the bytes that they speak of."""

    tree: dict[str, Any]
    binary: bytes

    def view(self, number: int) -> bytes:
        view = self.tree["bufferViews"][number]
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def array(self, number: int) -> np.ndarray:
        found = self.tree["accessors"][number]
        width = 1 if found["type"] == "SCALAR" else int(found["type"][3:])
        return np.frombuffer(self.view(found["bufferView"]), WORDS[found["componentType"]]).reshape(-1, width)

    def image(self, texture: dict[str, int]) -> bytes:
        """What a material's texture shows, encoded."""
        source = self.tree["textures"][texture["index"]]["source"]
        return self.view(self.tree["images"][source]["bufferView"])

    def worlds(self) -> list[np.ndarray]:
        """(4, 4) of every node."""
        found = [np.eye(4)] * len(self.tree["nodes"])
        todo = [(root, np.eye(4)) for root in self.tree["scenes"][0]["nodes"]]
        while todo:
            number, above = todo.pop()
            node = self.tree["nodes"][number]
            found[number] = above @ np.array(node.get("matrix", np.eye(4).ravel()), float).reshape(4, 4).T
            todo += [(child, found[number]) for child in node.get("children", ())]
        return found

    def triangles(self, number: int) -> np.ndarray:
        """(t, 3, 3) corners in the world of a node and of all below it."""
        worlds, parts, todo = self.worlds(), [np.zeros((0, 3, 3))], [number]
        while todo:
            number = todo.pop()
            node = self.tree["nodes"][number]
            todo += node.get("children", ())
            for part in self.tree["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
                points = self.array(part["attributes"]["POSITION"]) @ worlds[number][:3, :3].T + worlds[number][:3, 3]
                parts.append(points[self.array(part["indices"]).reshape(-1, 3)])
        return np.concatenate(parts)

    def by_id(self) -> dict[str, int]:
        """Number of every node that says whose it is."""
        nodes = enumerate(self.tree["nodes"])
        return {node["extras"]["id"]: number for number, node in nodes if "id" in node.get("extras", {})}


def read_gltf(path: Path) -> Gltf:
    """The file at `path`."""
    content = path.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    tree = json.loads(content[20 : 20 + length])
    assert struct.unpack_from("<4sII", content) == (b"glTF", 2, len(content))
    return Gltf(tree, content[28 + length :])
