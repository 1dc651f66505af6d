"""One piece of furniture as a USD asset: a light component layer with a payload, and the heavy geometry behind it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import fast_simplification
import numpy as np
import trimesh
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdPhysics, Vt

from echomodel.vocabulary import vocabulary
from echousd.room.looks import look, palette_for
from echousd.room.materials import write_looks
from echousd.room.surface import Surface, surface

LICENCE = "Apache-2.0"
COLLIDER_FACES = 400


def new_stage(default_prim: str, kind: str = ".usda", data: Mapping[str, Any] | None = None) -> Usd.Stage:
    """An empty stage in memory with the metadata that all our layers carry."""
    stage = Usd.Stage.Open(Sdf.Layer.CreateAnonymous(kind))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    layer = stage.GetRootLayer()
    layer.defaultPrim = default_prim
    if data:
        layer.customLayerData = dict(data)
    return stage


def without_stage(stage: Usd.Stage, finish: Callable[[Sdf.Layer], None]) -> Sdf.Layer:
    """A copy of a stage's layer, finished where no stage looks on: that would try to load what is not on disk yet."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.TransferContent(stage.GetRootLayer())
    with Sdf.ChangeBlock():
        finish(layer)
    return layer


def layer_bytes(layer: Sdf.Layer, suffix: str) -> bytes:
    """The layer as it would lie on disk; the same content gives the same bytes. `suffix`: `.usda` or `.usdc`."""
    if suffix == ".usda":
        return layer.ExportToString().encode("utf-8")
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        path = Path(folder) / f"layer{suffix}"
        if not layer.Export(str(path)):
            raise OSError(f"cannot write a layer to {folder}")
        return path.read_bytes()


def write_mesh(stage: Usd.Stage, path: str, form: Surface) -> UsdGeom.Mesh:
    """Author a UsdGeomMesh with indexed normals and `st`, and a GeomSubset per material group if there are several."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    # Blender merges an Xform with an only child that has no transform of its own, and the Xform's name is lost.
    # In floats: three.js fails on whole numbers in doubles of a usdc.
    mesh.AddTranslateOp(UsdGeom.XformOp.PrecisionFloat).Set(Gf.Vec3f(0.0))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(form.points))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(form.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(form.faces.ravel()))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(form.extent))
    primvars = UsdGeom.PrimvarsAPI(mesh)
    normals = primvars.CreatePrimvar("normals", Sdf.ValueTypeNames.Normal3fArray, UsdGeom.Tokens.faceVarying)
    normals.Set(Vt.Vec3fArray.FromNumpy(form.normals))
    normals.SetIndices(Vt.IntArray.FromNumpy(form.normal_index))
    st = primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.faceVarying)
    st.Set(Vt.Vec2fArray.FromNumpy(form.st))
    st.SetIndices(Vt.IntArray.FromNumpy(form.st_index))
    if len(form.groups) > 1:
        for name, faces in form.groups.items():
            subset = UsdGeom.Subset.Define(stage, f"{path}/{name}")
            subset.CreateElementTypeAttr(UsdGeom.Tokens.face)
            subset.CreateFamilyNameAttr("materialBind")
            subset.CreateIndicesAttr(Vt.IntArray.FromNumpy(faces))
        UsdGeom.Subset.SetFamilyType(mesh, "materialBind", UsdGeom.Tokens.partition)
    return mesh


def approximation(category: str) -> str:
    """The UsdPhysics approximation of a category's collider, `convexHull` or `convexDecomposition`."""
    return "convexHull" if vocabulary().category(category).solid else "convexDecomposition"


def collider(mesh: trimesh.Trimesh, category: str) -> trimesh.Trimesh:
    """A light mesh for collisions: a hull where the approximation is one, else the shape with few faces."""
    if approximation(category) == "convexHull":
        return _reduced(mesh.convex_hull, 120).convex_hull
    return _reduced(mesh, COLLIDER_FACES)


def geometry_layer(name: str, form: Surface, collision: trimesh.Trimesh, data: Mapping[str, Any]) -> Sdf.Layer:
    """`<name>_geo`: the mesh `<name>_mesh` and, as a guide, `<name>_collider`."""
    stage = new_stage(name, ".usdc", data)
    UsdGeom.Xform.Define(stage, f"/{name}")
    write_mesh(stage, f"/{name}/{name}_mesh", form)
    path = f"/{name}/{name}_collider"
    every = np.arange(len(collision.faces))
    guide = write_mesh(stage, path, surface(collision, {"collider": every}))
    guide.CreatePurposeAttr(UsdGeom.Tokens.guide)
    return stage.GetRootLayer()


def component_layer(
    name: str, category: str, style: str, extent: np.ndarray, groups: Sequence[str], data: Mapping[str, Any]
) -> Sdf.Layer:
    """`<name>.usda`: kind, extentsHint, asset info, looks of its own and the payload `./<name>_geo.usdc`.

    Arguments:
        name, category, style: words; the style chooses the looks, which a room's materials layer overrides.
        extent: (2, 3) float, metres.
        groups: material groups of the mesh.
        data: customLayerData.
    """
    stage = new_stage(name, ".usda", data)
    prim = UsdGeom.Xform.Define(stage, f"/{name}").GetPrim()
    model = Usd.ModelAPI(prim)
    model.SetKind(Kind.Tokens.component)
    model.SetAssetName(name)
    model.SetAssetIdentifier(Sdf.AssetPath(f"./{name}.usda"))
    UsdGeom.ModelAPI.Apply(prim).SetExtentsHint([Gf.Vec3f(*map(float, extent[0])), Gf.Vec3f(*map(float, extent[1]))])
    prim.SetDocumentation(f"{category}: origin at the centre of the bottom face, +Y up, +Z is the front; metres")
    mesh, palette = f"/{name}/{name}_mesh", palette_for(style)
    bindings = {f"{mesh}/{group}" if len(groups) > 1 else mesh: group for group in groups}
    write_looks(stage, {group: look(palette, group) for group in groups}, bindings, f"/{name}/Looks")
    return without_stage(stage, lambda layer: _add_payload(layer, name))


def _add_payload(layer: Sdf.Layer, name: str) -> None:
    payload = Sdf.Payload(f"./{name}_geo.usdc", Sdf.Path(f"/{name}"))
    layer.GetPrimAtPath(f"/{name}").payloadList.prependedItems.append(payload)


def _reduced(mesh: trimesh.Trimesh, faces: int) -> trimesh.Trimesh:
    """The mesh with at most about `faces` triangles, used vertices only."""
    if len(mesh.faces) > faces:
        points, triangles = fast_simplification.simplify(
            np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), target_count=faces, agg=5
        )
        mesh = trimesh.Trimesh(points, triangles, process=True)
    out = mesh.copy()
    out.update_faces(out.nondegenerate_faces())
    out.remove_unreferenced_vertices()
    return out
