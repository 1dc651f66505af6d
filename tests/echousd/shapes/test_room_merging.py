"""Parts by role, or merged by body, or as one closed surface: the same shape, box, slots and bodies."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from echomodel.furniture import solids
from echomodel.furniture.style import WIDTH, piece_of
from echousd.shapes.geometry import FRAME, Geometry, Origin, Part
from echousd.shapes.joinery import assembled
from echousd.shapes.merging import merged
from echousd.shapes.surface import surface

SIZE = np.array([0.9, 1.0, 0.45])


def piece(category: str, seed: int = 0, faces: int = 5000) -> Geometry:
    parts = solids(category, *piece_of(np.random.default_rng(seed).uniform(-1, 1, WIDTH)), SIZE)
    return assembled(parts, SIZE, faces=faces, origin=Origin("parts"))


def test_parts_are_named_for_what_they_are():
    names = {category: {part.name for part in piece(category).parts} for category in ("chair", "double_bed", "tv")}
    assert {"legs", "seat", "back"} <= names["chair"]
    assert {"headboard", "mattress", "pillows"} <= names["double_bed"]
    assert {"housing", "screen"} <= names["tv"]
    chest = next(made for made in (piece("dresser", seed) for seed in range(5)) if made.joints)
    assert {"case", "top", "drawer_1_mesh"} <= {part.name for part in chest.parts}
    assert {part.name for part in chest.coarse} == {part.name for part in chest.parts}


@pytest.mark.parametrize("how", ["bodies", "closed"])
@pytest.mark.parametrize("category", ["dresser", "armchair", "plant", "bookshelf"])
def test_fewer_meshes_of_the_same_shape(category, how):
    made = piece(category)
    found = merged({"one": made, "two": made}, how, 5000)
    assert found["one"] is found["two"]
    fewer = found["one"]
    assert len(fewer.parts) == len({part.body for part in made.parts})
    assert {part.body for part in fewer.parts} == {part.body for part in made.parts}
    if made.coarse:
        assert {part.name for part in fewer.parts} == {part.name for part in fewer.coarse}
    assert fewer.faces <= 5000
    assert fewer.watertight
    np.testing.assert_allclose(fewer.mesh.bounds, made.mesh.bounds, atol=1e-6)
    for part in fewer.parts:
        assert sorted(np.concatenate(list(part.slots.values()))) == list(range(len(part.mesh.faces)))
    if how == "closed":
        assert all(part.mesh.is_watertight for part in fewer.parts)
        assert fewer.mesh.volume <= 1.02 * made.mesh.volume  # overlaps count once


def side(p, q, r):
    """Above zero where r is to the left of the way from p to q."""
    (x, z), (u, v) = np.moveaxis(q - p, -1, 0), np.moveaxis(r - p, -1, 0)
    return x * v - z * u


@pytest.mark.parametrize("how", ["bodies", "closed"])
def test_merged_meshes_have_an_atlas_without_overlaps(how):
    pytest.importorskip("xatlas")
    (part,) = merged({"one": piece("chair", faces=800)}, how, 800)["one"].parts
    form = surface(part.mesh, part.slots, atlas=True, crease=part.crease)
    assert 0 <= form.st.min() < form.st.max() <= 1
    corners = form.st[form.st_index].reshape(-1, 3, 2).astype(float)
    turn = side(corners[:, 0], corners[:, 1], corners[:, 2])
    corners, turn = corners[np.abs(turn) > 1e-7], turn[np.abs(turn) > 1e-7]
    a, b, c = np.moveaxis(corners, 1, 0)
    middle = corners.mean(1)[:, None]  # inside[i, k]: whether triangle k holds the middle of triangle i
    inside = np.logical_and.reduce([side(p, q, middle) * turn > 0 for p, q in ((a, b), (b, c), (c, a))])
    assert len(a) > 100
    assert (inside.sum(1) == 1).all()


def test_a_closed_surface_keeps_a_small_budget_and_says_what_is_not_closed():
    plant = next(made for made in (piece("plant", seed) for seed in range(9)) if made.faces > 2500)
    assert merged({"fern": plant}, "closed", 2500)["fern"].faces <= 2500
    assert merged({"fern": plant}, "parts", 2500)["fern"] is plant
    fixed = next(made for made in (piece("dresser", seed) for seed in range(5)) if made.joints)
    assert merged({"chest": fixed}, "closed", 5000)["chest"].parts[0].body == FRAME
    box = trimesh.creation.box()
    box.update_faces(np.arange(12) > 0)
    lid_off = replace(plant, parts=(Part("crate", box, {"wood": np.arange(11)}),), coarse=())
    with pytest.raises(ValueError, match=r"part 'crate' is no closed solid \(\w+\); leave out merge=closed"):
        merged({"fern": lid_off}, "closed", 5000)
