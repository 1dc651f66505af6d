"""A small library of models for tests, of our own making: OBJ with textures, glb, USD in centimetres and Z-up."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

RED = (200, 30, 30)


def seat(width=0.5, height=0.9, depth=0.5):
    """A seat with its back at -Z, so that its front is +Z; stands on y = 0."""
    plate = trimesh.creation.box((width, 0.06, depth))
    plate.apply_translation((0, 0.45 * height, 0))
    back = trimesh.creation.box((width, 0.55 * height, 0.05))
    back.apply_translation((0, 0.725 * height, -depth / 2 + 0.025))
    legs = [trimesh.creation.box((0.05, 0.42 * height, 0.05)) for _ in range(4)]
    for leg, (x, z) in zip(legs, ((-1, -1), (1, -1), (1, 1), (-1, 1)), strict=True):
        leg.apply_translation((x * (width / 2 - 0.025), 0.21 * height, z * (depth / 2 - 0.025)))
    return trimesh.util.concatenate([plate, back, *legs])


def chest(width=1.2, height=0.8, depth=0.45):
    """A box with two drawers' handles at +Z."""
    body = trimesh.creation.box((width, height, depth - 0.03))
    body.apply_translation((0, height / 2, -0.015))
    handles = [trimesh.creation.box((0.2, 0.03, 0.03)) for _ in range(2)]
    for handle, y in zip(handles, (0.3, 0.7), strict=True):
        handle.apply_translation((0, y * height, depth / 2 - 0.015))
    return trimesh.util.concatenate([body, *handles])


def picture(color=RED, side=4):
    """PNG of one colour."""
    out = io.BytesIO()
    Image.new("RGB", (side, side), color).save(out, "PNG")
    return out.getvalue()


def write_obj(folder: Path, name: str, mesh, *, texture: str = "wood.png", scale: float = 1.0) -> Path:
    """`name.obj` with a material that has a texture, as tools write them."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.mtl").write_text(f"newmtl wood\nKd 1 1 1\nNs 50\nmap_Kd {texture}\n")
    if not texture.startswith(("/", "..")) and "missing" not in texture:
        (folder / texture).write_bytes(picture())
    lines = [f"mtllib {name}.mtl", "usemtl wood"]
    lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in mesh.vertices * scale]
    lines += [f"vt {x:.4f} {y:.4f}" for x, y, _ in mesh.vertices]
    lines += ["f " + " ".join(f"{c + 1}/{c + 1}" for c in face) for face in mesh.faces]
    path = folder / f"{name}.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


def write_glb(folder: Path, name: str, mesh) -> Path:
    """`name.glb` with a texture inside."""
    folder.mkdir(parents=True, exist_ok=True)
    image = Image.open(io.BytesIO(picture((30, 160, 60))))
    material = trimesh.visual.material.PBRMaterial(
        name="paint", baseColorTexture=image, metallicFactor=0.0, roughnessFactor=0.6
    )
    shown = mesh.copy()
    shown.visual = trimesh.visual.TextureVisuals(uv=mesh.vertices[:, :2], material=material)
    path = folder / f"{name}.glb"
    path.write_bytes(trimesh.Scene(shown).export(file_type="glb"))
    return path


def write_usd(
    path: Path, mesh, *, centimetres=False, z_up=False, label="", own_transform=None, licence="", texture=""
) -> Path:
    """A stage with one mesh; in centimetres and Z-up where asked, its root with a transform of its own."""
    path.parent.mkdir(parents=True, exist_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 0.01 if centimetres else 1.0)
    UsdGeom.SetStageUpAxis(stage, "Z" if z_up else "Y")
    root = UsdGeom.Xform.Define(stage, "/piece")
    stage.SetDefaultPrim(root.GetPrim())
    points = np.asarray(mesh.vertices) * (100 if centimetres else 1)
    if z_up:
        points = np.stack([points[:, 0], -points[:, 2], points[:, 1]], 1)
    if own_transform is not None:
        root.AddTransformOp().Set(Gf.Matrix4d(*np.asarray(own_transform, float).T.ravel()))
    form = UsdGeom.Mesh.Define(stage, "/piece/form")
    form.CreatePointsAttr([tuple(map(float, p)) for p in points])
    form.CreateFaceVertexCountsAttr([3] * len(mesh.faces))
    form.CreateFaceVertexIndicesAttr(np.asarray(mesh.faces).ravel().tolist())
    form.CreateSubdivisionSchemeAttr("none")
    form.CreateExtentAttr([tuple(map(float, points.min(0))), tuple(map(float, points.max(0)))])
    st = UsdGeom.PrimvarsAPI(form).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, "vertex")
    st.Set([(float(x), float(y)) for x, y, _ in mesh.vertices])
    material = UsdShade.Material.Define(stage, "/piece/Looks/paint")
    shader = UsdShade.Shader.Define(stage, "/piece/Looks/paint/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set((0.1, 0.2, 0.7))
    if texture:
        image = UsdShade.Shader.Define(stage, "/piece/Looks/paint/image")
        image.CreateIdAttr("UsdUVTexture")
        image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(texture)
        output = image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
        shader.GetInput("diffuseColor").ConnectToSource(output)
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    UsdShade.MaterialBindingAPI.Apply(form.GetPrim()).Bind(material)
    if label:
        from pxr import UsdSemantics

        UsdSemantics.LabelsAPI.Apply(root.GetPrim(), "category").CreateLabelsAttr([label])
    if licence:
        stage.GetRootLayer().customLayerData = {"asset_license": licence, "author": "A. Joiner"}
    stage.Save()
    return path


def small_library(folder: Path) -> Path:
    """Six models of four kinds below a folder, CC0 but for the glb."""
    (folder / "LICENSE.txt").parent.mkdir(parents=True, exist_ok=True)
    (folder / "LICENSE.txt").write_text("CC0 1.0 Universal, public domain\n")
    write_obj(folder / "chairs", "dining_chair", seat())
    write_usd(folder / "beds/double_bed.usda", seat(1.8, 1.0, 2.1), centimetres=True, z_up=True)
    write_glb(folder / "storage", "nightstand", chest(0.5, 0.5, 0.4))
    write_usd(folder / "storage/thing_17.usda", chest(1.6, 2.2, 0.6), label="wardrobe", licence="CC-BY-4.0")
    write_obj(folder / "lamps", "table_lamp", seat(0.25, 0.45, 0.25))
    write_obj(folder / "lamps", "pendant_lamp", seat(0.5, 0.7, 0.5))
    return folder
