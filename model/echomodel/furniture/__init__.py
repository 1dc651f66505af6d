"""Parametric furniture for every category: solids that give a watertight mesh and a signed distance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echomodel.furniture.solids import Joint, Solid, mesh_of
from echomodel.furniture.style import Choices, Style
from echomodel.late import Late
from echomodel.vocabulary import vocabulary

__all__ = ["Choices", "Style", "draw_choices", "draw_style", "mesh_of", "sample_size", "solids"]

draw_choices, draw_style = Late(f"{__name__}.drawn:draw_choices"), Late(f"{__name__}.drawn:draw_style")
sample_size = Late(f"{__name__}.drawn:sample_size")
Builder = Callable[[np.ndarray, Style, Choices], list[Solid]]
# Module -> its programs, functions of these names; one is loaded when a category asks for it.
PROGRAMS = {
    "chairs": ("dining_chair", "chair", "chinese_chair", "dressing_chair", "bar_stool", "office_chair", "stool",
               "bench", "ottoman"),
    "sofas": ("armchair", "lounge_chair", "multi_seat_sofa", "loveseat_sofa", "sofa", "l_shaped_sofa",
              "chaise_longue_sofa", "lazy_sofa"),
    "tables": ("dining_table", "coffee_table", "side_table", "round_end_table", "corner_side_table", "console_table",
               "desk", "dressing_table"),
    "storage": ("nightstand", "wardrobe"), "floor_lamps": ("floor_lamp", "wall_lamp"),
    "cabinets": ("dresser", "sideboard", "cabinet", "children_cabinet", "tv_stand"),
    "shelving": ("bookshelf", "shelf", "wine_cabinet"),
    "beds": ("double_bed", "single_bed"), "kids_beds": ("kids_bed",),
    "lamps": ("pendant_lamp", "table_lamp"), "chandeliers": ("ceiling_lamp",),
    "kitchens": ("base_unit", "wall_unit", "tall_unit", "sink_unit", "hob_unit", "dishwasher", "fridge", "range_hood",
                 "kitchen_island"),
    "bathrooms": ("toilet", "washbasin", "shower", "bathtub", "mirror_cabinet", "towel_radiator", "washing_machine"),
    "household": ("coat_rack", "shoe_cabinet", "radiator", "fireplace", "piano", "cot", "toy_box", "garden_table",
                  "garden_chair", "plant", "tv"),
}  # fmt: skip
UNSAID = ("", "board")
BY_MATERIAL = {"fabric": "upholstery", "shade": "shade", "leaf": "leaf", "mirror": "mirror"}


def solids(category: str, style: Style, choices: Choices, size: np.ndarray) -> list[Solid]:
    """The parts of one piece of furniture, about as large as `size`.

    Arguments:
        category: a word of the vocabulary; raises `UnknownWord` for others.
        style: what the piece shares with its suite.
        choices: what the style leaves open.
        size: (3,) width x, height y, depth z in metres.

    Raises ValueError for a size that is not three positive numbers.
    """
    name = vocabulary().category(category).name
    size = np.asarray(size, float)
    if size.shape != (3,) or not (np.isfinite(size).all() and (size > 0).all()):
        raise ValueError(f"size of {name} is {size.tolist()}, need three positive numbers in metres")
    return _named(_builder(name)(size, style, choices))


def _named(parts: list[Solid]) -> list[Solid]:
    """The parts with their moving bodies numbered: drawer_1, drawer_2, door_1 ... in the order of the program.

    Those that the program gave no role have one by what they are made of.
    """
    names: dict[int, Joint] = {}
    counts: Counter[str] = Counter()
    out = []
    for part in parts:
        if part.joint is not None:
            if id(part.joint) not in names:
                counts[part.joint.body] += 1
                names[id(part.joint)] = replace(part.joint, body=f"{part.joint.body}_{counts[part.joint.body]}")
            part = replace(part, joint=names[id(part.joint)])
        out.append(part if part.role not in UNSAID else replace(part, role=BY_MATERIAL.get(part.material, "body")))
    return out


def _builder(name: str) -> Builder:
    """The program of a category, or of the one that its row is like."""
    row = vocabulary().category(name)
    for word in (name, row.like or row.sgfront):
        for module, programs in PROGRAMS.items():
            if word in programs:
                return Late(f"{__name__}.{module}:{word}")
    raise ValueError(f"no furniture is made for {name}")
