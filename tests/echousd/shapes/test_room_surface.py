import numpy as np
import pytest
import trimesh
from solid_boxes import box_mesh

from echomodel.furniture.cloth import Sheet, cover
from echomodel.furniture.solids import Tube
from echomodel.triangles import Mesh
from echomodel.vocabulary import vocabulary
from echousd.shapes.finishes.slots import HARMONIES, SLOTS, metres_of
from echousd.shapes.geometry import CREASE, DRAPED
from echousd.shapes.looks import SHOWN, alternatives, look, palette_for
from echousd.shapes.sources.whole import BANDS, cut, material_groups
from echousd.shapes.surface import creased_normals, surfaces, unshared
from echousd.stage.taxonomy import ade20k


def surface(mesh, groups, *, atlas=False, crease=CREASE):
    return surfaces([(mesh, groups, crease)], atlas=atlas)[0]


def slow_creased_normals(mesh, crease):
    out = []
    for f, face in enumerate(mesh.faces):
        for vertex in face:
            total = np.zeros(3)
            for g in np.flatnonzero((mesh.faces == vertex).any(1)):
                if mesh.face_normals[f] @ mesh.face_normals[g] >= np.cos(crease):
                    total += mesh.face_normals[g] * mesh.area_faces[g]
            out.append(total / np.linalg.norm(total))
    return np.array(out)


@pytest.mark.parametrize("mesh", [trimesh.creation.box(), trimesh.creation.cylinder(1, 2, sections=16)])
def test_creased_normals_equal_the_slow_way(mesh):
    normals, index = creased_normals(mesh, np.radians(40))
    np.testing.assert_allclose(normals[index], slow_creased_normals(mesh, np.radians(40)), atol=2e-4)


def test_box_keeps_hard_edges_and_ball_is_smooth():
    normals, _ = creased_normals(trimesh.creation.box())
    assert len(normals) == 6
    ball = trimesh.creation.icosphere(subdivisions=3)
    normals, index = creased_normals(ball)
    assert len(normals) <= len(ball.vertices)
    np.testing.assert_allclose(normals[index], ball.vertices[ball.faces.ravel()], atol=0.03)


@pytest.mark.parametrize("atlas", [False, True])
def test_texture_coordinates_for_every_corner(atlas):
    if atlas:
        pytest.importorskip("xatlas")
    form = surface(box_mesh((1, 2, 3)), {"wood": np.arange(12)}, atlas=atlas)
    assert len(form.st_index) == 36
    assert form.st_index.max() == len(form.st) - 1
    corners = form.st[form.st_index].reshape(-1, 3, 2)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    assert (areas > 0).all()
    if atlas:
        assert form.st.min() >= 0
        assert form.st.max() <= 1
    else:  # one picture of wood covers so many metres
        wanted = trimesh.creation.box((1, 2, 3)).area_faces / metres_of("wood") ** 2
        np.testing.assert_allclose(areas, wanted, rtol=1e-4)


def test_box_projection_is_upright_and_not_mirrored():
    form = surface(box_mesh((1, 2, 3)), {"wood": np.arange(12)})
    points = form.points[form.faces]
    corners = form.st[form.st_index].reshape(-1, 3, 2)
    for triangle, st in zip(points, corners, strict=True):
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        turn = np.cross(st[1] - st[0], st[2] - st[0])
        assert turn > 0, f"mirrored on the side {normal}"


def test_cut_keeps_a_mesh_closed_and_leaves_no_triangle_across():
    ball = trimesh.creation.icosphere(subdivisions=3)
    halves = cut(ball, 1, 0.31)
    assert halves.is_watertight
    assert halves.volume == pytest.approx(ball.volume, rel=2e-3)
    side = np.sign(np.round(halves.vertices[halves.faces][..., 1] - 0.31, 9))
    assert ((side.min(1) >= 0) | (side.max(1) <= 0)).all()


@pytest.mark.parametrize("category", [entry.name for entry in vocabulary().categories])
def test_every_category_has_looks_for_all_its_faces(category):
    mesh, groups = material_groups(box_mesh((1.6, 1.1, 2.0)), category)
    faces = np.sort(np.concatenate(list(groups.values())))
    assert (faces == np.arange(len(mesh.faces))).all()
    assert mesh.is_watertight
    for group in groups:
        assert all(0 <= c <= 1 for palette in HARMONIES for c in look(palette, group).color)
    assert vocabulary().category(category).look in BANDS
    assert ade20k(category)


def test_bed_has_linen_above_wood_and_a_headboard():
    mesh, groups = material_groups(box_mesh((1.8, 1.0, 2.0)), "double_bed")
    assert set(groups) == {"wood", "linen", "blanket"}
    centre = mesh.triangles_center
    assert centre[groups["linen"], 1].min() > 0.2
    assert centre[groups["blanket"], 2].min() > centre[groups["linen"], 2].max() - 1e-6
    back = centre[:, 2] < -0.95
    assert set(np.flatnonzero(back)) <= set(groups["wood"])


def test_palettes_are_steady():
    assert palette_for("room 7") == palette_for("room 7")
    assert len({palette_for(f"style {i}") for i in range(300)}) == len(HARMONIES)


def test_a_written_room_shows_a_few_harmonies_its_own_first():
    for chosen in HARMONIES:
        shown = alternatives(chosen)
        assert shown[0] == chosen
        assert len(set(shown)) == len(shown) == SHOWN
    assert set(alternatives("clay", "boho")) >= set(vocabulary().known_style("boho").palettes)


def test_boards_that_meet_share_no_point_and_stay_closed():
    boards = [trimesh.creation.box((1, 1, 1)) for _ in range(3)]
    boards[1].apply_translation((1, 0, 0))
    boards[2].apply_translation((0, 0, 1))
    mesh = trimesh.util.concatenate(boards)
    form = surface(mesh, {"wood": np.arange(len(mesh.faces))})
    assert len(np.unique(form.points, axis=0)) == len(form.points) == 24
    np.testing.assert_allclose(form.points, mesh.vertices, atol=2e-5)
    assert (form.extent[0] >= mesh.bounds[0] - 1e-7).all()
    assert (form.extent[1] <= mesh.bounds[1] + 1e-7).all()
    assert trimesh.Trimesh(form.points, form.faces, process=False).is_watertight
    alone = boards[0].vertices.astype(np.float32)
    assert unshared(alone, boards[0].faces, np.zeros(8), np.zeros(12, int)) is alone


def test_surfaces_of_several_meshes_are_those_of_each():
    meshes = [box_mesh((1, 2, 3)), trimesh.creation.icosphere(subdivisions=2), box_mesh((1, 2, 3))]
    meshes.append(trimesh.util.concatenate([meshes[0], box_mesh((0.1, 0.1, 0.1))]))
    slots = ("wood", "picture_fern", "fabric", "wood")
    forms = [(m, {w: np.arange(len(m.faces))}, c) for m, w, c in zip(meshes, slots, (0.7, 0.2, 1.0, 0.7), strict=True)]
    for together, (mesh, groups, crease) in zip(surfaces(forms), forms, strict=True):
        alone = surface(mesh, groups, crease=crease)
        for name in ("points", "faces", "normals", "normal_index", "st", "st_index"):
            np.testing.assert_array_equal(getattr(together, name), getattr(alone, name))


def test_the_ends_of_a_cord_around_a_cushion_share_no_point_and_stay_closed():
    turn = np.linspace(0, 2 * np.pi, 13)
    cord = Tube(points=(np.stack([np.cos(turn), 0 * turn, np.sin(turn)], 1) + 0.3)[[*range(12), 0]], radius=0.01)
    mesh = trimesh.Trimesh(*cord.local_mesh(), process=False)
    assert len(np.unique(mesh.vertices.astype(np.float32), axis=0)) < len(mesh.vertices)
    form = surface(mesh, {"fabric": np.arange(len(mesh.faces))})
    assert len(np.unique(form.points, axis=0)) == len(form.points)
    np.testing.assert_allclose(form.points, mesh.vertices, atol=1e-5)
    assert trimesh.Trimesh(form.points, form.faces, process=False).is_watertight


def test_what_is_woven_into_cloth_that_hangs_runs_on_over_its_folds():
    curtain = Sheet(front=_waves(0.004), back=_waves(-0.004))
    mesh = Mesh(*curtain.local_mesh())
    hung, board = (surface(mesh, {"wood": np.arange(len(mesh.faces))}, crease=one) for one in (DRAPED, CREASE))
    apart = [len(np.unique(np.column_stack([one.faces.ravel(), one.st_index]), axis=0)) for one in (hung, board)]
    assert apart[0] == len(hung.points)  # one place in the picture for each point
    assert apart[1] > apart[0]


def test_what_is_woven_into_cloth_that_lies_runs_on_over_its_edges():
    cloth = cover((-0.8, 0.3, -1.0), (0.8, 0.6, 1.0), "wood", 0.1, 0.0, np.random.default_rng(1), falls=True)
    mesh = Mesh(*cloth.mesh())
    form = surface(mesh, {"wood": np.arange(len(mesh.faces))}, crease=DRAPED)
    place, shown = form.points[form.faces], form.st[form.st_index].reshape(-1, 3, 2) * metres_of("wood")
    edge, line = np.roll(place, -1, 1) - place, np.roll(shown, -1, 1) - shown
    hangs = (place[..., 0] > 0.72) & (np.abs(edge[..., 1]) > 0.04) & (np.abs(edge[..., 2]) < 0.03)
    assert hangs.sum() > 20
    drawn = np.linalg.norm(line[hangs], axis=1) / np.linalg.norm(edge[hangs], axis=1)
    assert np.median(drawn) > 0.7  # else its threads were drawn out into lines


def _waves(z: float) -> np.ndarray:
    """(4, 33, 3) points of cloth in four deep folds, 0.5 m wide and 1 m high, `z` metres before its middle."""
    turn, y = np.meshgrid(np.linspace(0, 8 * np.pi, 33), np.linspace(0, 1, 4))
    return np.stack([turn / (16 * np.pi), y, 0.08 * np.cos(turn) + z], -1)


def test_each_book_has_a_back_of_its_own_that_reads_along_it_and_plain_sides():
    """Its letters run from its head to its foot where it stands, from left to right where it lies."""
    sizes = [(0.03, 0.2, 0.15), (0.025, 0.24, 0.16), (0.04, 0.21, 0.15), (0.22, 0.03, 0.15)]
    rows, found = SLOTS["spines"].rows, []
    for size in sizes:
        mesh = box_mesh(size)
        form = surface(mesh, {"spines": np.arange(len(mesh.faces))})
        st = form.st[form.st_index].reshape(-1, 3, 2)
        front = mesh.face_normals[:, 2] > 0.9
        (down,) = np.flatnonzero(np.array(size) == max(size))
        ends = mesh.triangles[front][..., down] > 0
        assert st[front][ends, 0] == pytest.approx(float(down == 0), abs=1e-4)
        assert st[front][~ends, 0] == pytest.approx(float(down == 1), abs=1e-4)
        assert st[np.abs(mesh.face_normals[:, 2]) < 0.1, :, 0].max() < 0.03
        found.append(np.floor(st[front, :, 1].mean() * rows))
        assert np.ptp(st[front, :, 1]) == pytest.approx(1 / rows, abs=1e-4)
    assert len(set(found)) > 1
