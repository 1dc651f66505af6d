"""Stronger layers as people write them: without units, and with facts that the room states already."""

import warnings

import numpy as np
import pytest
from pxr import Sdf, Usd, UsdGeom
from small_room import BARE, StandIn, small_graph

import echousd
from echousd.checks import check
from echousd.draw.drawables import read_drawables
from echousd.exporting.formats import export
from echousd.stage.graphs import update_graph
from echousd.stage.read import StatedTwice, read_graph


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    return room.save(tmp_path_factory.mktemp("rooms") / "bedroom", preview=False)


def stronger(root, name="mine.usda"):
    """A layer over the room, without any metadata."""
    path = root.with_name(name)
    path.unlink(missing_ok=True)
    layer = Sdf.Layer.CreateNew(str(path))
    layer.subLayerPaths = [f"./{root.name}"]
    layer.Save()
    return Usd.Stage.Open(layer)


def width(stage):
    corners = np.concatenate([(d.triangles @ d.world[:3, :3].T).reshape(-1, 3) for d in read_drawables(stage)])
    return np.ptp(corners[:, 0])


def test_units_come_from_the_layer_that_defines_the_room(root):
    stage = stronger(root)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01  # what USD makes of it
    assert width(stage) == pytest.approx(width(Usd.Stage.Open(str(root))))
    report = check(stage)
    assert not report.broken
    assert not report.placement
    told = [fault.message for fault in report.warnings if fault.rule == "echo:Units"]
    assert told[0] == (
        "mine.usda sets no metersPerUnit, metersPerUnit is 1 in bedroom.usda; taken as 1 here, "
        "other programs may not: set it"
    )


def test_what_is_made_of_a_layer_without_units_says_them(root, tmp_path):
    stage = stronger(root, "export.usda")
    flat = Usd.Stage.Open(str(export(stage.GetRootLayer().realPath, tmp_path / "flat.usda")))
    assert UsdGeom.GetStageMetersPerUnit(flat) == 1.0
    assert UsdGeom.GetStageUpAxis(flat) == "Y"


def test_other_units_than_the_layers_below_are_an_error(root):
    stage = stronger(root, "wrong.usda")
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    (fault,) = [fault for fault in check(stage).errors if fault.rule == "echo:Units"]
    assert (
        fault.message
        == "metersPerUnit is 0.01 in wrong.usda, but metersPerUnit is 1 in bedroom.usda, allowed: the same"
    )


def state(stage, name, subject, predicate, object_, confidence=None):
    prim = stage.DefinePrim(f"/Room/SceneGraph/{name}", "EchoRelation")
    prim.CreateRelationship("echo:subject").SetTargets([f"/Room/Objects/{subject}"])
    prim.CreateRelationship("echo:object").SetTargets([f"/Room/Objects/{object_}"])
    prim.CreateAttribute("echo:predicate", Sdf.ValueTypeNames.Token).Set(predicate)
    if confidence is not None:
        prim.CreateAttribute("echo:confidence", Sdf.ValueTypeNames.Double).Set(confidence)


def test_a_fact_stated_under_another_name_is_one_fact_with_the_stronger_confidence(root):
    stage = stronger(root, "again.usda")
    state(stage, "my_edge", "wardrobe", "taller_than", "bed", 0.5)
    with pytest.warns(
        StatedTwice, match="my_edge>: states 'wardrobe taller_than bed' as </Room/SceneGraph/wardrobe__t"
    ):
        graph = read_graph(stage)
    assert [r.confidence for r in graph.relations if r.predicate == "taller_than"] == [0.5]
    assert len(graph.relations) == len(small_graph().relations)
    report = check(stage)
    assert not [fault for fault in report.errors if fault.rule.startswith("echo:")]
    assert ["one fact, confidence 0.5" in fault.message for fault in report.warnings if "Consistent" in fault.rule] == [
        True
    ]


def test_a_relation_of_any_name_survives_regeneration(root, tmp_path):
    room = echousd.generate(small_graph(), model=StandIn(), shapes="boxes", place=False, **BARE)
    root = room.save(tmp_path / "bedroom", preview=False)
    stage = stronger(root)
    state(stage, "my_edge", "wardrobe", "right", "bed")
    stage.Save()
    graph = read_graph(stage)
    echousd.generate(graph, model=StandIn(), shapes="boxes", place=False, **BARE).save(root.parent, preview=False)
    stage.Reload()
    with pytest.warns(StatedTwice):
        assert read_graph(stage).replaced(room=graph.room) == graph


def test_a_fact_that_two_prims_state_goes_with_both(root):
    stage = stronger(root, "gone.usda")
    state(stage, "my_edge", "wardrobe", "taller_than", "bed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StatedTwice)
        graph = read_graph(stage).unrelate("wardrobe", "taller_than", "bed")
    update_graph(stage, graph)
    assert read_graph(stage) == graph
