"""Small things that rooms share."""

import re
from dataclasses import replace

import echousd
from echousd.dressing.dress import dress
from echousd.options import RoomOptions


def test_rooms_share_the_assets_of_small_things_in_usual_sizes():
    full = RoomOptions(walls=True, dress="full")
    room = echousd.generate("samples/living_room.usda", seed=1, shapes="boxes", options=full)
    known, met = dict[str, tuple](), 0
    for seed in range(8):
        for name, recipe in dress(replace(room, provenance=replace(room.provenance, seed=seed))).recipes.items():
            if re.fullmatch(r"small_\w+_[a-l]", name):
                met += name in known
                assert known.setdefault(name, recipe) == recipe, name
    assert met >= 10
