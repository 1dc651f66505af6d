"""Values of other people's stages: what a table of numbers and a mesh may be, and what is said of others."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom

from echousd.graph import Node, SceneGraph
from echousd.stage import values
from echousd.stage.encoding import StageError
from echousd.stage.graphs import write_graph
from echousd.stage.units import conventions

NAMES = Sdf.ValueTypeNames
STAGES: list[Usd.Stage] = []  # a prim does not keep its stage


def attribute(kind: Sdf.ValueTypeName, value: object) -> Usd.Attribute:
    STAGES.append(Usd.Stage.CreateInMemory())
    found = STAGES[-1].DefinePrim("/a").CreateAttribute("a", kind)
    found.Set(value)
    return found


@pytest.mark.parametrize(
    ("kind", "value", "width", "whole", "shape"),
    [
        (NAMES.FloatArray, [1.5, 2.0], 1, False, (2,)),
        (NAMES.IntArray, [1, 2, 3], 1, True, (3,)),
        (NAMES.IntArray, [1, 2, 3], 1, False, (3,)),
        (NAMES.Point3fArray, [Gf.Vec3f(1, 2, 3)], 3, False, (1, 3)),
        (NAMES.Float2Array, [Gf.Vec2f(1, 2)] * 4, 2, False, (4, 2)),
        (NAMES.Point3fArray, [], 3, False, (0, 3)),
        (NAMES.IntArray, [], 1, True, (0,)),
        (NAMES.FloatArray, [], 3, False, (0, 3)),
    ],
)
def test_tables_have_their_width_and_kind(kind, value, width, whole, shape):
    found = values.array(attribute(kind, value), width, whole=whole)
    assert found.shape == shape
    assert found.dtype == (np.int64 if whole else np.float64)
    assert found.tolist() == np.array(value, float).reshape(shape).tolist()


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("short", "str short"),
        ("two\n  lines", "str two lines"),
        ("x" * 40, f"str {'x' * 40}"),
        ("x" * 41, f"str {'x' * 37}..."),
        (1.5, "float 1.5"),
    ],
)
def test_a_value_of_another_type_is_shown_by_its_type_and_forty_letters(value, told):
    assert values.shown(value) == told


@pytest.mark.parametrize(
    ("kind", "value", "width", "whole", "allowed"),
    [
        (NAMES.Float2Array, [Gf.Vec2f(1, 2)], 3, False, "a list of 3 numbers each"),
        (NAMES.FloatArray, [1.0, 2.0, 3.0], 3, False, "a list of 3 numbers each"),
        (NAMES.Point3fArray, [Gf.Vec3f(1, 2, 3)], 1, False, "a list of numbers"),
        (NAMES.FloatArray, [1.0, 2.0], 1, True, "a list of whole numbers"),
        (NAMES.Int3Array, [Gf.Vec3i(1, 2, 3)], 1, True, "a list of whole numbers"),
        (NAMES.StringArray, ["1", "2"], 1, False, "a list of numbers"),
        (NAMES.String, "12", 1, False, "a list of numbers"),
        (NAMES.Float, 1.0, 1, False, "a list of numbers"),
    ],
)
def test_other_tables_are_refused(kind, value, width, whole, allowed):
    with pytest.raises(StageError, match=f"</a>: a is .*, allowed: {allowed}$"):
        values.array(attribute(kind, value), width, whole=whole)


def mesh(counts: list[int], indices: list[int]) -> UsdGeom.Mesh:
    STAGES.append(Usd.Stage.CreateInMemory())
    found = UsdGeom.Mesh.Define(STAGES[-1], "/a")
    found.CreatePointsAttr([Gf.Vec3f(x, y, 0) for x in (0, 1) for y in (0, 1)])
    found.CreateFaceVertexCountsAttr(counts)
    found.CreateFaceVertexIndicesAttr(indices)
    return found


def test_a_mesh_is_read_up_to_its_limits(monkeypatch):
    monkeypatch.setattr(values, "MAX_CORNERS", 4)
    found = values.mesh_arrays(mesh([4, 0], [0, 1, 3, 2]))
    assert (found.counts.tolist(), found.indices.tolist()) == ([4, 0], [0, 1, 3, 2])
    assert not len(values.mesh_arrays(mesh([], [])).counts)


@pytest.mark.parametrize(
    ("counts", "indices", "text"),
    [
        ([3], [0, 1, 2, 3], r"asks for 3 corners \(least 3\) and faceVertexIndices has 4, allowed: as many, 0 or more"),
        ([4], [0, 1, 2], r"asks for 4 corners \(least 4\) and faceVertexIndices has 3"),
        ([4, -1], [0, 1, 2], r"asks for 3 corners \(least -1\) and faceVertexIndices has 3"),
        ([5], [0, 1, 2, 3, 0], r"asks for 5 corners .* 0 or more each, 4 in all$"),
        ([3], [0, 1, 4], "reaches from 0 to 4, allowed: 0 to 3$"),
        ([3], [-1, 1, 3], "reaches from -1 to 3, allowed: 0 to 3$"),
    ],
)
def test_faces_that_points_cannot_make_are_refused(monkeypatch, counts, indices, text):
    monkeypatch.setattr(values, "MAX_CORNERS", 4)
    with pytest.raises(StageError, match=text):
        values.mesh_arrays(mesh(counts, indices))


@pytest.mark.parametrize(
    ("kind", "value", "allowed"),
    [
        (NAMES.Double, 1e10, "-1e\\+09 to 1e\\+09"),
        (NAMES.Double, -1e10, "-1e\\+09 to 1e\\+09"),
        (NAMES.Double, float("nan"), "-1e\\+09 to 1e\\+09"),
        (NAMES.Bool, True, "one number"),
        (NAMES.String, "3", "one number"),
    ],
)
def test_a_number_is_one_and_within_reach(kind, value, allowed):
    with pytest.raises(StageError, match=f"</a>: a is .*, allowed: {allowed}$"):
        values.number(attribute(kind, value))
    assert values.number(attribute(NAMES.Double, -1e9)) == -1e9
    assert values.number(attribute(NAMES.Int, 3)) == 3.0


def test_of_a_transform_the_number_out_of_reach_is_told():
    prim = attribute(NAMES.Float, 1.0).GetPrim()
    table = np.array([[2.0, 0, 0, 3], [0, 2, 0, 4], [0, 0, 2, 5], [0, 0, 0, 1]])
    assert values.matrix(Gf.Matrix4d(table.T), prim).tolist() == table.tolist()
    for worst in (-1e30, np.inf, np.nan):
        table[1, 3] = worst
        with pytest.raises(StageError) as found:
            values.matrix(Gf.Matrix4d(table.T), prim)
        assert f"</a>: its transform holds {worst:g}, allowed: -1e+09 to 1e+09" in str(found.value)


def test_conventions_of_several_rooms_ask_for_one():
    stage = Usd.Stage.CreateInMemory()
    for name in ("/one", "/two"):
        write_graph(SceneGraph("bedroom", (Node("bed", "bed"),)), stage, room=name)
    with pytest.raises(ValueError, match=r": 2 rooms, name one \(room_path\): /one, /two$"):
        conventions(stage)
    assert conventions(stage, "/two")["room_path"] == "/two"
