"""Models of a library in other people's software: in centimetres, Z-up, with a transform of their own, OBJ and glb."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from environments import python_of, run, three
from pxr import Usd, UsdGeom, UsdShade
from small_models import chest, seat, write_glb, write_obj, write_usd
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.assets.index import index
from echousd.exporting.formats import export

pytestmark = pytest.mark.clients
HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bedroom of such models, which it holds itself."""
    folder = tmp_path_factory.mktemp("library")
    turn = np.diag([2.0, 2.0, 2.0, 1.0])
    turn[:3, 3] = 5, 1, 3
    write_usd(folder / "models/double_bed.usda", seat(1.8, 1.0, 2.1), centimetres=True, z_up=True)
    write_usd(folder / "models/wardrobe.usda", chest(0.8, 1.1, 0.3), own_transform=turn)
    write_glb(folder / "models", "nightstand", chest(0.5, 0.5, 0.4))
    write_obj(folder / "models", "table_lamp", seat(0.25, 0.45, 0.25), scale=100)
    write_obj(folder / "models", "pendant_lamp", seat(0.5, 0.7, 0.5))
    file = index([folder / "models"], folder / "lib.parquet").file
    made = echousd.generate(small_graph(), model=StandIn(), shapes="library", assets=file, collect=True, **BARE)
    return made.save(folder / "bedroom", preview=False)


def models(room: Path) -> dict[str, tuple[np.ndarray, np.ndarray, str]]:
    """Name of an object -> corners of its model as drawn, (3) each, Y up, metres; name of its material."""
    stage = Usd.Stage.Open(str(room))
    cache = UsdGeom.XformCache()
    found = {}
    for prim in Usd.PrimRange(stage.GetPrimAtPath("/Room/Objects"), Usd.TraverseInstanceProxies()):
        if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != UsdGeom.Tokens.guide:
            to_world = np.array(cache.GetLocalToWorldTransform(prim))
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), float) @ to_world[:3, :3] + to_world[3, :3]
            look = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0].GetPrim().GetName()
            found[str(prim.GetPath()).split("/")[3]] = (points.min(0), points.max(0), look)
    return found


@pytest.mark.parametrize("client", ["blender", "blender42"])
def test_blender_shows_models_at_their_size_with_their_materials(client: str, room: Path) -> None:
    wanted = models(room)
    assert {look for _, _, look in wanted.values()} == {"paint", "wood"}
    lines = run(python_of(client), HERE / "blender_import.py", room).splitlines()
    things = [json.loads(line) for line in lines if line.startswith("{")]
    meshes = [thing for thing in things if thing["type"] == "MESH" and not thing["hidden"] and thing["materials"]]
    for name, (low, high, look) in wanted.items():
        corners = np.array([[low[0], -high[2], low[1]], [high[0], -low[2], high[1]]])  # Blender has Z up
        near = [m for m in meshes if np.abs(np.array([m["low"], m["high"]]) - corners).max() < 2e-3]
        assert [m["materials"][0].partition(".")[0] for m in near] == [look], name


def test_three_shows_models_at_their_size_with_their_pictures(room: Path, tmp_path: Path) -> None:
    wanted = models(room)
    package = export(room, tmp_path / "room.usdz", physics=False)
    there = json.loads(run("node", HERE / "three_load.mjs", three(), package))
    assert there["withoutUv"] == []
    assert there["maps"]["map"] >= 4  # lamp, pendant and two nightstands
    low = np.min([corner for corner, _, _ in wanted.values()], axis=0)
    high = np.max([corner for _, corner, _ in wanted.values()], axis=0)
    assert (np.array(there["low"]) <= low + 1e-3).all()
    assert (np.array(there["high"]) >= high - 1e-3).all()
    np.testing.assert_allclose(there["high"], high, atol=0.25)
