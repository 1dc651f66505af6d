"""The rooms in other people's software, really run (`make clients`); each client has an environment of its own."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from environments import python_of, run, three
from pxr import Usd, UsdGeom

from echousd.export import export
from echousd.stage import read_graph

pytestmark = pytest.mark.clients
HERE = Path(__file__).parent


def bounds(room: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """World bounds of every object by name, as this OpenUSD sees them (Y up, metres)."""
    stage = Usd.Stage.Open(str(room))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    found = {}
    for prim in stage.GetPrimAtPath("/Room/Objects").GetChildren():
        box = cache.ComputeWorldBound(prim).ComputeAlignedRange()
        found[prim.GetName()] = (np.array(box.GetMin()), np.array(box.GetMax()))
    return found


def visible_meshes(stage: Usd.Stage) -> dict[str, list[UsdGeom.Mesh]]:
    """Visible meshes below each object and part of the shell."""
    found: dict[str, list[UsdGeom.Mesh]] = {}
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
            owner = prim.GetPath().GetPrefixes()[2].name
            found.setdefault(owner, []).append(UsdGeom.Mesh(prim))
    return found


@pytest.mark.parametrize("client", ["usd2411", "usd2551"])
def test_older_openusd_reads_the_same_room(client: str, rooms: list[Path]) -> None:
    python = python_of(client)
    for room in rooms:
        there = json.loads(run(python, HERE / "pxr_read.py", room))
        graph = read_graph(room)
        assert there["version"] < list(Usd.GetVersion())
        assert there["composition_errors"] == []
        assert there["unbound"] == []
        assert set(there["objects"]) == set(graph.names)
        assert sorted(map(tuple, there["relations"])) == sorted(relation.triple for relation in graph.relations)
        for name, (low, high) in bounds(room).items():
            np.testing.assert_allclose(there["objects"][name]["low"], low, atol=1e-4)
            np.testing.assert_allclose(there["objects"][name]["high"], high, atol=1e-4)
            assert there["objects"][name]["labels"] == [graph.node(name).category]


def test_nvidia_validator_reports_no_failures(rooms: list[Path]) -> None:
    command = python_of("nvidia").with_name("nvidia_usd_validate")
    for room in rooms:
        said = run(command, room, accepted=(0, 1))  # 1 with warnings too
        counts = [int(number) for number in re.findall(r"(?:Failures|Errors): (\d+)", said)]
        assert "No issues found" in said or (counts and not any(counts)), said


def test_blender_imports_names_places_uvs_and_materials(rooms: list[Path]) -> None:
    python = python_of("blender")
    for room in rooms:
        lines = run(python, HERE / "blender_import.py", room).splitlines()
        things = [json.loads(line) for line in lines if line.startswith("{")]
        by_name = {thing["name"]: thing for thing in things}
        meshes = [thing for thing in things if thing["type"] == "MESH"]
        assert {"Room", "Objects", "Shell"} <= set(by_name)
        assert by_name["Objects"]["parent"] == "Room"
        stage = Usd.Stage.Open(str(room))
        wanted = visible_meshes(stage)
        assert len(meshes) == sum(map(len, wanted.values()))
        placed = UsdGeom.XformCache()
        for name in bounds(room):
            (mesh,) = wanted[name]
            # Exact corners: the bounds of a turned object's local box are wider than the object.
            turn = np.array(placed.GetLocalToWorldTransform(mesh.GetPrim()))
            points = np.array(mesh.GetPointsAttr().Get(), float) @ turn[:3, :3] + turn[3, :3]
            low, high = points.min(0), points.max(0)
            # Y up in USD is Z up in Blender: (x, y, z) -> (x, -z, y).
            lower, upper = (low[0], -high[2], low[1]), (high[0], -low[2], high[1])
            same = [
                thing
                for thing in meshes
                if np.allclose(thing["low"], lower, atol=0.03) and np.allclose(thing["high"], upper, atol=0.03)
            ]
            # Blender merges an Xform with its only mesh and keeps the mesh's name; shared assets get .001, .002 ...
            same = [thing for thing in same if thing["name"].split(".")[0] == mesh.GetPrim().GetName()]
            assert same, f"{room}: {name} is not where it should be"
            (found,) = same
            assert found["parent"] in ("Objects", name)
            assert found["faces"] == len(mesh.GetFaceVertexCountsAttr().Get())
            assert found["uv_layers"] == ["st"]
            assert min(found["uv_spread"]) > 0.01
            subsets = [p for p in mesh.GetPrim().GetChildren() if p.IsA(UsdGeom.Subset)]
            assert len(found["materials"]) == max(len(subsets), 1)
        assert by_name["Floor_mesh"]["materials"]
        assert {thing["name"] for thing in things if thing["type"] == "CAMERA"} == {"perspective", "top"}


def test_three_loads_the_package_for_the_web(rooms: list[Path], tmp_path: Path) -> None:
    for number, room in enumerate(rooms):
        package = export(room, tmp_path / f"{number}.usdz")
        there = json.loads(run("node", HERE / "three_load.mjs", three(), package))
        stage = Usd.Stage.Open(str(room))
        wanted = visible_meshes(stage)
        meshes = [mesh for parts in wanted.values() for mesh in parts]
        assert there["triangles"] == sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in meshes)
        assert there["meshes"] >= len(meshes)
        assert there["withoutUv"] == []
        assert set(wanted) <= set(there["objects"])
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
        box = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
        # three.js grows each mesh's own box with it when it is turned: never smaller, a little larger at most.
        assert (np.array(there["low"]) <= np.array(box.GetMin()) + 1e-3).all()
        assert (np.array(there["high"]) >= np.array(box.GetMax()) - 1e-3).all()
        np.testing.assert_allclose(there["low"], list(box.GetMin()), atol=0.25)
        np.testing.assert_allclose(there["high"], list(box.GetMax()), atol=0.25)
