"""A room in one file: flat USD, usdz for the web and for ARKit, and glb."""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdUtils

from echousd.drawables import Drawable, Paint, read_drawables, read_image
from echousd.stage import open_stage

if TYPE_CHECKING:
    import trimesh

    from echousd.room.room import Room

ENDINGS = (".usdz", ".glb", ".usda", ".usdc")


def export(room: str | Path, out: str | Path, *, arkit: bool = False, force: bool = False) -> Path:
    """Write a room (any stage) as one file.

    Arguments:
        room: root layer of the room.
        out: `.usdz` (one flat usda inside, which web viewers read), `.glb`, or a flat `.usda` or `.usdc`.
        arkit: usdz with one usdc inside, as Apple's viewers want it.
        force: replace a file that is in the way.

    Raises ValueError for other endings, a file in the way, a stage that does not open, or a path that is not writable.
    """
    from echousd.room.assets import layer_bytes
    from echousd.room.save import write_whole

    out = Path(out)
    if out.suffix not in ENDINGS:
        raise ValueError(f"{out}: cannot export to {out.suffix or 'no ending'!r}, allowed: {', '.join(ENDINGS)}")
    if arkit and out.suffix != ".usdz":
        raise ValueError(f"{out}: --arkit makes a .usdz, found {out.suffix!r}")
    if out.exists() and not force:
        raise ValueError(f"{out}: exists; choose another file or use --force")
    if out.suffix == ".glb":
        content = glb(open_stage(room))
    elif out.suffix == ".usdz":
        content = usdz(Path(room), arkit=arkit)
    else:
        content = layer_bytes(flat_layer(Path(room)), out.suffix)
    write_whole(out, content)
    return out


def flat_layer(
    path: Path, *, textures: Path | None = None, guides: bool = True, layouts: Room | None = None
) -> Sdf.Layer:
    """Everything that a stage composes to, in one layer without references, variants or absolute paths.

    Arguments:
        path: the stage's root layer.
        textures: folder that receives copies of the images; without it textured materials get their plain colour.
        guides: keep prims of purpose guide (colliders) and physics.
        layouts: the room whose layouts become variants again.
    """
    from echousd.room.compose import place_layouts

    layer = open_stage(path).Flatten(False)
    stage = Usd.Stage.Open(layer)
    for prim in list(stage.TraverseAll()):
        if prim.IsValid() and not guides and _is_guide(prim):
            stage.RemovePrim(prim.GetPath())
    for prim in stage.TraverseAll():
        prim.ClearMetadata("assetInfo")  # it holds the absolute path of a file that is no longer needed
        for attribute in prim.GetAttributes():
            if attribute.GetTypeName() == Sdf.ValueTypeNames.Double3 and attribute.GetName().startswith("xformOp:"):
                _as_float(attribute)  # some web loaders cannot read doubles of whole numbers from a crate file
            elif attribute.GetTypeName() == Sdf.ValueTypeNames.Asset and attribute.Get():
                _take_along(attribute, textures)
    _drop_unused_materials(stage)
    if layouts is not None and len(layouts.layouts) > 1:
        place_layouts(stage, layouts)
    return layer


def usdz(path: Path, *, arkit: bool = False) -> bytes:
    """A usdz package of one flat layer and its textures."""
    with tempfile.TemporaryDirectory(prefix="echousd-") as scratch:
        folder = Path(scratch)
        layer = flat_layer(path, textures=folder / "textures", guides=False)
        flat = folder / f"{path.stem}{'.usdc' if arkit else '.usda'}"
        layer.Export(str(flat))
        package = folder / "package.usdz"
        make = UsdUtils.CreateNewARKitUsdzPackage if arkit else UsdUtils.CreateNewUsdzPackage
        if not make(Sdf.AssetPath(str(flat)), str(package)):
            raise ValueError(f"{path}: cannot be packed as usdz")
        return package.read_bytes()


def glb(stage: Usd.Stage) -> bytes:
    """Binary glTF: one node per component, one mesh per material; y up, metres."""
    import trimesh

    scene = trimesh.Scene()
    materials: dict[Paint, Any] = {}
    for mesh in read_drawables(stage):
        for paint, faces in _own_faces(mesh):
            if paint not in materials:
                materials[paint] = _pbr(paint)
            part = _part(mesh, faces, materials[paint])
            name = f"{mesh.component}_{paint.name}"
            scene.add_geometry(part, node_name=name, geom_name=name, parent_node_name=mesh.component)
        scene.graph.update(frame_from="world", frame_to=mesh.component, matrix=mesh.world)
    if not scene.geometry:
        raise ValueError(f"{stage.GetRootLayer().identifier}: nothing to export, found no visible mesh")
    return bytes(scene.export(file_type="glb"))


def _is_guide(prim: Usd.Prim) -> bool:
    guide = prim.IsA(UsdGeom.Imageable) and UsdGeom.Imageable(prim).GetPurposeAttr().Get() == UsdGeom.Tokens.guide
    return guide or prim.GetTypeName() == "PhysicsScene"


def _as_float(attribute: Usd.Attribute) -> None:
    value, prim, name = attribute.Get(), attribute.GetPrim(), attribute.GetName()
    prim.RemoveProperty(name)
    prim.CreateAttribute(name, Sdf.ValueTypeNames.Float3, False).Set(tuple(float(v) for v in value))


def _take_along(attribute: Usd.Attribute, textures: Path | None) -> None:
    source = Path(attribute.Get().resolvedPath or attribute.Get().path)
    if textures is not None and source.is_file():
        textures.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, textures / source.name)
        attribute.Set(Sdf.AssetPath(f"./{textures.name}/{source.name}"))
        return
    image = attribute.GetPrim()
    fallback = image.GetAttribute("inputs:fallback").Get()
    for shader in image.GetParent().GetChildren():
        color = shader.GetAttribute("inputs:diffuseColor")
        if color and any(str(c).startswith(str(image.GetPath())) for c in color.GetConnections()):
            color.ClearConnections()
            color.Set(tuple(fallback)[:3] if fallback else (0.5, 0.5, 0.5))
    attribute.GetPrim().SetActive(False)
    attribute.Clear()


def _drop_unused_materials(stage: Usd.Stage) -> None:
    """Looks of assets that the room's own looks replace."""
    bound = {
        target
        for prim in stage.TraverseAll()
        for target in (
            prim.GetRelationship("material:binding").GetTargets() if prim.HasRelationship("material:binding") else ()
        )
    }
    unused = [p for p in stage.TraverseAll() if p.IsA(UsdShade.Material) and p.GetPath() not in bound]
    scopes = {prim.GetParent().GetPath() for prim in unused}
    for path in [prim.GetPath() for prim in unused]:
        stage.RemovePrim(path)
    for path in scopes:
        if not stage.GetPrimAtPath(path).GetAllChildren():
            stage.RemovePrim(path)


def _own_faces(mesh: Drawable) -> list[tuple[Paint, np.ndarray]]:
    owner = np.zeros(len(mesh.triangles), int)
    for number, (_, faces) in enumerate(mesh.paints):
        owner[faces] = number
    return [(p, np.flatnonzero(owner == n)) for n, (p, _) in enumerate(mesh.paints) if (owner == n).any()]


def _part(mesh: Drawable, faces: np.ndarray, material: Any) -> trimesh.Trimesh:
    import trimesh

    st = np.zeros((len(faces), 3, 2)) if mesh.st is None else mesh.st[faces]
    rows = np.concatenate([mesh.triangles[faces], mesh.normals[faces], st], axis=-1).reshape(-1, 8).astype(np.float32)
    unique, index = np.unique(rows, axis=0, return_inverse=True)
    visual = trimesh.visual.TextureVisuals(uv=unique[:, 6:], material=material)
    normals = unique[:, 3:6]
    return trimesh.Trimesh(unique[:, :3], index.reshape(-1, 3), vertex_normals=normals, visual=visual, process=False)


def _pbr(paint: Paint) -> Any:
    import trimesh
    from PIL import Image

    textured = Image.open(io.BytesIO(_png(read_image(paint.texture)))) if paint.texture else None
    return trimesh.visual.material.PBRMaterial(
        name=paint.name,
        baseColorFactor=[1.0, 1.0, 1.0, 1.0] if textured else [*paint.color, 1.0],
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
