"""Sources whose pieces are one mesh each: boxes, shapes that the network samples, models of a library."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import trimesh
from trimesh.intersections import slice_mesh_plane
from trimesh.util import append_faces

from echomodel.arrays import on_device
from echomodel.files import tables
from echomodel.late import Late
from echomodel.triangles import Mesh
from echomodel.vocabulary import vocabulary
from echousd.graph.arrays import DISTANCE, graph_batch, one_thread, rounded, seeded
from echousd.shapes.colliders import colliders_of
from echousd.shapes.geometry import Geometry, Origin, Part
from echousd.shapes.meshing import LEAST_FACES, mesh_from_shape
from echousd.shapes.sources.named import source_of
from echousd.shapes.sources.source import ShapeRequest, Shapes, having, per_asset
from echousd.shapes.styles import EQUAL, first_alike

if TYPE_CHECKING:
    from echousd.assets.choose import AssetWishes

TRIES = 6  # simplifications until the cut mesh is within its budget
geometry_of = Late("echousd.shapes.originals.loading:geometry_of")  # of models of others
descriptors, nearness = Late("echousd.assets.descriptor:descriptors"), Late("echousd.assets.descriptor:nearness")


def plain_boxes(request: ShapeRequest) -> Shapes:
    """Every object is the box that it fills."""
    size, origin = np.asarray(request.boxes.size, float), Origin("boxes")

    def make(row: int) -> Geometry:
        x, y, z = size[row]
        box = trimesh.creation.box(bounds=[(-x / 2, 0.0, -z / 2), (x / 2, y, z / 2)])
        return solid_geometry(box, request.graph.nodes[row].category, origin)

    return per_asset(request, make)


def solid_geometry(mesh: trimesh.Trimesh, category: str, origin: Origin) -> Geometry:
    """The geometry of one mesh (object frame, metres) whose category says which materials it has where."""
    cut, slots = material_groups(mesh, category)
    return Geometry((Part("mesh", Mesh.of(cut), slots),), colliders_of(Mesh.of(mesh), category), origin)


def sampled_shapes(request: ShapeRequest) -> Shapes:
    """Meshes of shapes from the model's shape branch (EchoScene 3.4).

    Objects of an edited graph that stay are sampled along, the others hear them.
    """
    size, grids = np.asarray(request.boxes.size, float), sampled_grids(request)

    def make(row: int) -> Geometry:
        node = request.graph.nodes[row]
        try:
            return within_budget(grids[row], size[row], node.category, request.faces)
        except ValueError as error:
            raise ValueError(f"shape of {node.name!r}: {error}; try another seed or shapes 'boxes'") from None

    return per_asset(request, make)


def within_budget(grid: np.ndarray, size: np.ndarray, category: str, faces: int) -> Geometry:
    """The geometry of a shape with at most `faces` triangles once it is cut along the borders of its materials.

    Arguments: as for `mesh_from_shape`, raises what it raises. A budget of a few hundred may be too small for the cuts
    alone; the best that was found is given then.
    """
    asked, best = faces, None
    for _ in range(TRIES):
        found = solid_geometry(mesh_from_shape(grid, size, faces=asked), category, Origin("sdf"))
        best = found if best is None or found.faces < best.faces else best
        if found.faces <= faces or asked == LEAST_FACES:
            break
        asked = max(LEAST_FACES, int(0.99 * asked * faces / found.faces))
    assert best is not None
    return best


def sampled_grids(request: ShapeRequest) -> np.ndarray:
    """(n, 64, 64, 64) float32 TSDFs of all objects; raises ValueError for a model without a shape branch."""
    model = having("shape", request.model)
    with request.timer.stage("shapes") as tell, one_thread():
        grids = model.sample_shapes(
            graph_batch(request.graph), request.centred, generator=seeded(request.seed, "shapes"), steps=request.steps,
            progress=tell, **request.edited,
        )  # fmt: skip
        return rounded(on_device(grids, None), DISTANCE).astype(np.float32)


def chosen_models(request: ShapeRequest, source: str) -> Shapes:
    """What `ShapeRequest.retrieved` holds, as geometry of a source; objects with one model and size share an asset."""
    size = np.asarray(request.boxes.size, float)
    geometry: dict[str, Geometry] = {}
    nodes, chosen, files = request.graph.nodes, request.retrieved.chosen, request.retrieved.files

    def same(i: int, j: int) -> bool:
        agree = chosen[nodes[i].name] == chosen[nodes[j].name] and nodes[i].category == nodes[j].category
        return agree and bool(np.abs(size[j] / size[i] - 1).max() <= EQUAL)

    first = first_alike(request.rows, same)
    with request.timer.stage("meshes", len(first)) as tell:
        for done, row in enumerate(request.rows, 1):
            name, category = nodes[row].name, nodes[row].category
            if first[row] == row:
                box = (float(size[row][0]), float(size[row][1]), float(size[row][2]))
                collect = request.retrieved.collect
                geometry[name] = geometry_of(files[name], chosen[name], category, box, source, collect=collect)
            tell(done, len(first))
    return Shapes({nodes[i].name: nodes[j].name for i, j in first.items()}, geometry)


def shape_nearness(request: ShapeRequest, shapes: str, wishes: AssetWishes) -> Mapping[str, Mapping[str, float]] | None:
    """Object name -> id of a model -> cost of its shape against the generated one; None where nothing is guided.

    Raises ValueError for a library without descriptors. Arguments as for `retrieved`.
    """
    nodes = request.graph.nodes
    rows = [i for i, node in enumerate(nodes) if source_of(node, shapes) == "guided" and node.asset is None]
    records = [record for shelf in wishes.shelves.values() for record in shelf.records]
    if not rows or not records:
        return None
    if not any(record.descriptor for record in records):
        assert wishes.library is not None
        raise ValueError(f"{wishes.library.file}: holds no descriptors; index the library with --descriptors")
    found = descriptors(request.model, np.asarray(sampled_grids(request))[rows])
    return nearness(found, [nodes[i].name for i in rows], records)


@dataclass(frozen=True)
class Band:
    """A region of the object's box: a row of `bands.toml`, which says what its words mean."""

    group: str
    top: float = 1.0
    metres: bool = False


BANDS = {kind: tuple(Band(**row) for row in rows) for kind, rows in tables("bands.toml", __file__).items()}
HEADBOARD = 0.09  # metres at the back of a bed that are wood to the top
FOLD = 0.42  # share of a bed's length, from the foot, that the blanket covers
FRONT = 0.012  # metres behind the foremost plane that count as the front of a cabinet


def material_groups(mesh: trimesh.Trimesh, category: str) -> tuple[trimesh.Trimesh, dict[str, np.ndarray]]:
    """Cut a mesh (object frame, metres) along the borders of its materials: (mesh, group -> (m,) face numbers)."""
    laid = vocabulary().category(category).look
    lower, upper = mesh.bounds
    height = upper[1] - lower[1]
    bands = BANDS[laid]
    tops = [lower[1] + (min(p.top, 0.5 * height) if p.metres else p.top * height) for p in bands[:-1]]
    for top in tops:
        mesh = cut(mesh, 1, top)
    if laid == "bed":
        mesh = cut(mesh, 2, lower[2] + HEADBOARD)
        mesh = cut(mesh, 2, upper[2] - FOLD * (upper[2] - lower[2]))
    centre = np.asarray(mesh.triangles_center)
    number = np.searchsorted(np.array(tops), centre[:, 1])
    group = np.array([p.group for p in bands], dtype=object)[number]
    if laid == "bed":
        group[(group == "linen") & (centre[:, 2] > upper[2] - FOLD * (upper[2] - lower[2]))] = "blanket"
        group[centre[:, 2] < lower[2] + HEADBOARD] = "wood"
    elif laid == "cabinet":
        normal = mesh.face_normals
        group[(normal[:, 2] > 0.8) & (centre[:, 2] > upper[2] - FRONT - 0.04 * (upper[2] - lower[2]))] = "front"
    return mesh, {str(name): np.flatnonzero(group == name) for name in sorted(set(group))}


def cut(mesh: trimesh.Trimesh, axis: int, offset: float) -> trimesh.Trimesh:
    """Split the triangles that cross the plane `axis = offset`; a closed mesh stays closed.

    Vertices within 2 mm are moved onto the plane first, so that no slivers appear.
    """
    vertices = np.array(mesh.vertices)
    distance = vertices[:, axis] - offset
    vertices[np.abs(distance) < min(0.002, 0.01 * np.ptp(distance)), axis] = offset
    whole, normal = trimesh.Trimesh(vertices, mesh.faces, process=False), np.eye(3)[axis]
    halves = [slice_mesh_plane(whole, way * normal, offset * normal) for way in (1, -1)]
    return trimesh.Trimesh(*append_faces([half.vertices for half in halves], [half.faces for half in halves]))
