"""What an archive takes along: every image of the room, pixel for pixel, and no other file of the machine."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Usd

from echousd.draw.drawables import read_drawables
from echousd.exporting.formats import export
from echousd.exporting.packing import LeftOut, Reach
from echousd.textures import read_image

SQUARE = """
        def Mesh "{name}_mesh" (prepend apiSchemas = ["MaterialBindingAPI"])
        {{
            point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
            int[] faceVertexCounts = [4]
            int[] faceVertexIndices = [0, 1, 2, 3]
            texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
            rel material:binding = </Room/Looks/{name}>
        }}
"""
LOOK = """
        def Material "{name}"
        {{
            token outputs:surface.connect = </Room/Looks/{name}/surface.outputs:surface>
            def Shader "surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor.connect = </Room/Looks/{name}/image.outputs:rgb>
                token outputs:surface
            }}
            def Shader "image"
            {{
                uniform token info:id = "UsdUVTexture"
                asset inputs:file = @{path}@
                float3 outputs:rgb
            }}
        }}
"""


def room(folder: Path, textures: dict[str, str], extra: str = "") -> Path:
    """A room with one square per texture: name of the look -> asset path."""
    meshes = "".join(SQUARE.format(name=name) for name in textures)
    looks = "".join(LOOK.format(name=name, path=path) for name, path in textures.items())
    text = f"""#usda 1.0
(
    defaultPrim = "Room"
    metersPerUnit = 1
    upAxis = "Y"
)
def Xform "Room"
{{{meshes}
    {extra}
    def Scope "Looks"
    {{{looks}
    }}
}}
"""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "room.usda").write_text(text)
    return folder / "room.usda"


def paint(path: Path, color: tuple[int, int, int], size: int = 4) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    pixels = np.full((size, size, 3), color, np.uint8)
    pixels[0, 0] = 255 - pixels[0, 0]
    Image.fromarray(pixels).save(path)
    return path


def pixels_of(path: Path) -> dict[str, np.ndarray]:
    """Mesh name -> the image that colours it."""
    stage = Usd.Stage.Open(str(path))
    found = {}
    for mesh in read_drawables(stage):
        texture = mesh.paints[0][0].texture
        assert texture, mesh.path
        found[mesh.path] = read_image(texture)
    return found


def test_images_of_one_name_stay_distinct_and_a_round_trip_keeps_every_pixel(tmp_path):
    for name, color in (("a", (200, 10, 10)), ("b", (10, 200, 10)), ("c", (10, 10, 200))):
        paint(tmp_path / "in" / name / ("Wood.png" if name == "c" else "wood.png"), color)
    root = room(tmp_path / "in", {"a": "./a/wood.png", "b": "./b/wood.png", "c": "c/Wood.png"})
    first = export(root, tmp_path / "first.usdz")
    with zipfile.ZipFile(first) as package:
        assert len({name.casefold() for name in package.namelist()}) == 4
    second = export(first, tmp_path / "second.usdz")
    third = export(second, tmp_path / "third.usdz", arkit=True)
    wanted = pixels_of(root)
    assert len(wanted) == 3
    for packed in (first, second, third):
        found = pixels_of(packed)
        assert found.keys() == wanted.keys()
        for mesh, image in wanted.items():
            np.testing.assert_array_equal(found[mesh], image)
    scene = trimesh.load(export(second, tmp_path / "room.glb"))
    colors = {tuple(np.asarray(part.visual.material.baseColorTexture)[2, 2, :3]) for part in scene.geometry.values()}
    assert colors == {(200, 10, 10), (10, 200, 10), (10, 10, 200)}


def test_tiles_of_one_texture_go_along(tmp_path):
    for tile in (1001, 1002):
        paint(tmp_path / "in" / f"oak.{tile}.png", (tile % 256, 0, 0))
    path = export(room(tmp_path / "in", {"oak": "./oak.<UDIM>.png"}), tmp_path / "room.usdz")
    with zipfile.ZipFile(path) as package:
        assert sorted(package.namelist())[1:] == ["textures/oak.1001.png", "textures/oak.1002.png"]


OUTSIDE = {
    "texture": ("look", ""),
    "input": ("", "asset inputs:anything = @{path}@"),
    "array": ("", "asset[] list = [@./in.png@, @{path}@]"),
    "samples": ("", "asset moving.timeSamples = {{ 0: @./in.png@, 1: @{path}@ }}"),
    "metadata": ("", 'def Xform "Odd" (customData = {{ dictionary deep = {{ asset w = @{path}@ }} }}) {{}}'),
}


@pytest.mark.parametrize("kind", OUTSIDE)
@pytest.mark.parametrize("upwards", [False, True])
def test_files_outside_the_room_are_refused_by_prim_and_path(tmp_path, kind, upwards):
    secret = paint(tmp_path / "secret.png", (1, 2, 3))
    paint(tmp_path / "in" / "in.png", (1, 2, 3))
    named = "../secret.png" if upwards else str(secret)
    look, extra = OUTSIDE[kind]
    root = room(tmp_path / "in", {"look": named if look else "./in.png"}, extra.format(path=named))
    with pytest.raises(ValueError, match="secret") as refused:
        export(root, tmp_path / "room.usdz")
    assert str(root) in str(refused.value)
    assert "</Room" in str(refused.value)
    assert f"allowed: files in {tmp_path / 'in'} (--search DIR adds one)" in str(refused.value)
    assert not (tmp_path / "room.usdz").exists()
    if kind == "texture":
        with pytest.raises(ValueError, match=r"</Room/Looks/look/image> names .*secret\.png"):
            export(root, tmp_path / "room.glb")
    export(root, tmp_path / "allowed.usdz", search=[tmp_path])


def test_links_and_layers_that_lead_outside_are_refused(tmp_path):
    secret = paint(tmp_path / "secret.png", (1, 2, 3))
    root = room(tmp_path / "in", {"look": "./link.png"})
    (tmp_path / "in" / "link.png").symlink_to(secret)
    with pytest.raises(ValueError, match=r"names .*link\.png"):
        export(root, tmp_path / "room.usdz")
    (tmp_path / "private.usda").write_text('#usda 1.0\n(defaultPrim = "P")\ndef "P" {\n string diary = "dear"\n}\n')
    root = room(tmp_path / "other", {}, 'def "Taken" (references = @../private.usda@) {}')
    for ending in ("usdz", "usda", "glb"):
        with pytest.raises(ValueError, match=r"a layer of </Room/Taken> names .*private\.usda"):
            export(root, tmp_path / f"room.{ending}")


def test_links_of_files_and_folders_and_the_way_up_are_followed(tmp_path):
    root = room(tmp_path / "in", {})
    paint(tmp_path / "in" / "own.png", (1, 2, 3))
    (tmp_path / "in" / "own_link.png").symlink_to("own.png")
    (tmp_path / "in" / "out").symlink_to(tmp_path)
    (tmp_path / "out_link.png").symlink_to(paint(tmp_path / "secret.png", (1, 2, 3)))
    (tmp_path / "in" / "out_link.png").symlink_to(tmp_path / "secret.png")
    reach = Reach.of(Usd.Stage.Open(str(root)))
    held = [name for name in ("own.png", "own_link.png", "gone.png", ".") if reach.holds(f"{tmp_path}/in/{name}")]
    assert held == ["own.png", "own_link.png", "gone.png", "."]
    for name in ("..", "../secret.png", "out", "out/secret.png", "out/out_link.png", "out_link.png", "out/in/../x"):
        assert not reach.holds(f"{tmp_path}/in/{name}"), name


def test_a_package_names_nothing_beside_itself(tmp_path):
    secret = paint(tmp_path / "secret.png", (1, 2, 3))
    root = room(tmp_path / "in", {"look": str(secret)})
    with zipfile.ZipFile(tmp_path / "sent.usdz", "w") as package:
        package.write(root, "room.usda")
    with pytest.raises(ValueError, match=r"names .*secret\.png.*allowed: files in .*sent\.usdz"):
        export(tmp_path / "sent.usdz", tmp_path / "again.usdz")


def test_what_no_archive_holds_is_left_out_and_named(tmp_path):
    root = room(tmp_path / "in", {}, "asset notes = @./notes.txt@\n asset gone = @./gone.png@")
    (tmp_path / "in" / "notes.txt").write_text("private")
    with pytest.warns(LeftOut, match=r"</Room\.notes> names .*notes\.txt.*left out \(packed: \.png"):
        path = export(root, tmp_path / "room.usdz")
    with zipfile.ZipFile(path) as package:
        assert package.namelist() == ["room.usda"]


def test_a_pipe_for_an_image_is_refused_at_once(tmp_path):
    root = room(tmp_path / "in", {"look": "./wood.png"})
    os.mkfifo(tmp_path / "in" / "wood.png")
    for ending in ("usdz", "glb"):
        with pytest.raises(ValueError, match=r"</Room/Looks/look/image.*wood\.png: not a regular file"):
            export(root, tmp_path / f"room.{ending}")
