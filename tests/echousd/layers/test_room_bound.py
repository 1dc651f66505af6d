"""Nothing looks editable that colours nothing: every material is bound, in the room or in its asset alone."""

from pxr import Usd, UsdShade
from small_room import StandIn, small_graph

import echousd
from echousd.options import RoomOptions


def bound_and_all(path):
    stage = Usd.Stage.Open(str(path))
    bound, materials = set(), set()
    for prim in stage.Traverse():
        if prim.IsA(UsdShade.Material):
            materials.add(str(prim.GetPath()))
        for relation in prim.GetRelationships():
            if relation.GetName().startswith("material:binding"):
                bound |= {str(target) for target in relation.GetTargets()}
    return bound, materials


def test_every_material_is_bound_in_the_room_or_in_its_asset_alone(tmp_path):
    room = echousd.generate(
        small_graph(), seed=5, model=StandIn(), faces=800, options=RoomOptions(dress="some", walls=False)
    )
    root = room.save(tmp_path / "bedroom", preview=False)
    bound, materials = bound_and_all(root)
    unbound = materials - bound
    assert {path.split("/")[-2] for path in unbound} <= {"mtl"}, "of the room's own looks all are bound"
    assets = sorted(root.parent.glob("assets/*/*.usda"))
    assert assets
    for path in assets:
        bound, materials = bound_and_all(path)
        assert materials <= bound, path.name
