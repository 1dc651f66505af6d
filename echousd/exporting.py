"""A room in one file: flat USD, usdz for the web and for ARKit, and glb."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdUtils

from echousd.arkit import for_arkit
from echousd.drawables import Drawable, Paint, paint_image, read_drawables
from echousd.flattening import flat_layer
from echousd.naming import free_name
from echousd.packing import Package, Reach, images_beside, without_clock
from echousd.stage import open_stage
from echousd.stage.files import layer_bytes, write_all
from echousd.stage.layouts import selected_layout, showing_layout
from echousd.stage.values import reading

if TYPE_CHECKING:
    import trimesh

ENDINGS = (".usdz", ".glb", ".usda", ".usdc")


def export(
    room: str | Path,
    out: str | Path,
    *,
    arkit: bool = False,
    force: bool = False,
    search: Sequence[str | Path] = (),
    layout: int | None = None,
    physics: bool | None = None,
    pictures: bool = True,
) -> Path:
    """Write a room (any stage) as one file.

    Arguments:
        room: root layer of the room.
        out: `.usdz` (one flat usda inside, which web viewers read), `.glb`, or a flat `.usda` or `.usdc`.
        arkit: usdz as Apple's viewers want it: one usdc inside, Y up, without lights and scene graph.
        force: replace a file that is in the way.
        physics: keep bodies, colliders, joints and the scene, or none of it; None = in flat USD alone.
        layout: number of the layout that the file holds; None = the one that the room shows. The file says which.
        pictures: take images along; without them materials have plain colours, for importers that read none (MuJoCo
            4.0 refuses JPEG).
        search: folders besides the room's own whose layers and images may be taken along.

    Raises ValueError for other endings, a file in the way, a stage that does not open, one that names files outside its
    folder and `search`, or a path that is not writable.
    """
    out = Path(out)
    if out.suffix not in ENDINGS:
        raise ValueError(f"{out}: cannot export to {out.suffix or 'no ending'!r}, allowed: {', '.join(ENDINGS)}")
    if arkit and out.suffix != ".usdz":
        raise ValueError(f"{out}: --arkit makes a .usdz, found {out.suffix!r}")
    if physics and out.suffix == ".glb":
        raise ValueError(f"{out}: --physics: a .glb holds none, allowed: .usdz, .usda, .usdc")
    if not pictures and out.suffix == ".glb":
        raise ValueError(f"{out}: --no-pictures: a .glb holds its own, allowed: .usdz, .usda, .usdc")
    if out.exists() and not force:
        raise ValueError(f"{out}: exists; choose another file or use --force")
    stage = open_stage(room)
    beside: dict[Path, bytes] = {}
    reach = Reach.of(stage, search)
    reach.check_layers(stage)
    with showing_layout(stage, layout), reading(stage):
        if out.suffix == ".glb":
            content = glb(stage, reach)
        elif out.suffix == ".usdz":
            content = usdz(stage, Package(reach), arkit=arkit, physics=bool(physics), pictures=pictures)
        else:
            package = Package(reach, images_beside(out))
            layer = flat_layer(stage, package=package if pictures else None, physics=physics is not False)
            content = layer_bytes(_marked(layer, stage), out.suffix)
            beside = package.files(out.parent)
    write_all({out: content, **beside})
    return out


def usdz(
    stage: Usd.Stage, package: Package, *, arkit: bool = False, physics: bool = False, pictures: bool = True
) -> bytes:
    """A usdz package of one flat layer and its images."""
    root = package.reach.room
    layer = _marked(flat_layer(stage, package=package if pictures else None, physics=physics), stage)
    if arkit:
        for_arkit(layer)
    with tempfile.TemporaryDirectory(prefix="echousd-") as scratch:
        folder = Path(scratch)
        write_all(package.files(folder))
        flat = folder / f"{root.stem}{'.usdc' if arkit else '.usda'}"
        packed = folder / "package.usdz"
        make = UsdUtils.CreateNewARKitUsdzPackage if arkit else UsdUtils.CreateNewUsdzPackage
        try:
            layer.Export(str(flat))
            whole = make(Sdf.AssetPath(str(flat)), str(packed)) and zipfile.is_zipfile(packed)
        except Tf.ErrorException:
            whole = False
        if not whole:  # USD does not say why
            raise ValueError(
                f"{root}: cannot be packed as usdz in {folder.parent}, the folder of temporary files (its disk may be "
                "full; TMPDIR names another); nothing was changed"
            )
        return without_clock(packed.read_bytes())


def _marked(layer: Sdf.Layer, stage: Usd.Stage) -> Sdf.Layer:
    """The layer, which says the stage's layout that it holds where there are several."""
    layout = selected_layout(stage)
    if layout:
        layer.customLayerData = {**layer.customLayerData, "layout": layout}
    return layer


def glb(stage: Usd.Stage, reach: Reach) -> bytes:
    """Binary glTF: one node per component, one mesh per material; y up, metres; images within reach."""
    import trimesh

    scene = trimesh.Scene()
    materials: dict[Paint, Any] = {}
    taken: set[str] = set()  # a second node of one name would take the first one's place
    for mesh in read_drawables(stage):
        for paint, faces in _own_faces(mesh):
            if paint not in materials:
                if paint.texture:
                    reach.check(paint.texture, f"<{paint.image}>")
                materials[paint] = _pbr(paint)
            part = _part(mesh, faces, materials[paint])
            name = free_name(f"{mesh.component}_{paint.name}", taken)
            taken.add(name)
            scene.add_geometry(part, node_name=name, geom_name=name, parent_node_name=mesh.component)
        scene.graph.update(frame_from="world", frame_to=mesh.component, matrix=mesh.world)
    if not scene.geometry:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to export, found no visible mesh")
    if selected_layout(stage):
        scene.metadata["layout"] = selected_layout(stage)
    return bytes(scene.export(file_type="glb"))


def _own_faces(mesh: Drawable) -> list[tuple[Paint, np.ndarray]]:
    """Materials of a mesh with the triangles that show them, each material once."""
    order = {paint: number for number, (paint, _) in reversed(list(enumerate(mesh.paints)))}
    owner = np.zeros(len(mesh.triangles), int)
    for paint, faces in mesh.paints:
        owner[faces] = order[paint]
    return [(p, np.flatnonzero(owner == n)) for p, n in sorted(order.items(), key=_number) if (owner == n).any()]


def _number(entry: tuple[Paint, int]) -> int:
    return entry[1]


def _part(mesh: Drawable, faces: np.ndarray, material: Any) -> trimesh.Trimesh:
    import trimesh

    textured = material.baseColorTexture is not None  # coordinates that nothing reads are left out
    st = mesh.st[faces] if textured and mesh.st is not None else np.zeros((len(faces), 3, 2))
    rows = np.concatenate([mesh.triangles[faces], mesh.normals[faces], st], axis=-1).reshape(-1, 8).astype(np.float32)
    unique, index = np.unique(rows, axis=0, return_inverse=True)
    visual = trimesh.visual.TextureVisuals(uv=unique[:, 6:] if textured else None, material=material)
    normals = unique[:, 3:6]
    return trimesh.Trimesh(unique[:, :3], index.reshape(-1, 3), vertex_normals=normals, visual=visual, process=False)


def _pbr(paint: Paint) -> Any:
    import trimesh
    from PIL import Image

    textured = Image.open(io.BytesIO(_png(paint_image(paint)))) if paint.texture else None
    return trimesh.visual.material.PBRMaterial(
        name=paint.name,
        baseColorFactor=[*(min(c, 1.0) for c in paint.tint), 1.0] if textured else [*paint.color, 1.0],
        baseColorTexture=textured,
        metallicFactor=paint.metallic,
        roughnessFactor=paint.roughness,
        emissiveFactor=list(paint.emissive),
    )


def _png(pixels: np.ndarray) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG")
    return out.getvalue()
