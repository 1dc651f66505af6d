"""Material slots of furniture, small things and shell: colour, pattern and gloss; harmonies of colours for them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from echomodel.dressing.household import PICTURES
from echomodel.dressing.textiles import RUGS
from echousd.srgb import of_hexadecimal


@dataclass(frozen=True)
class Slot:
    """How one kind of material looks."""

    color: str  # a field of `Harmony`, or an sRGB hex of its own
    roughness: float  # roughness, metallic, opacity: of a UsdPreviewSurface
    pattern: str = ""  # a word of `baking.PATTERNS`, "" = plain; `picture_0` ... are pictures
    metres: float = 1.0  # of surface that one picture of the pattern covers; 0 = the whole of it fits the thing
    metallic: float = 0.0
    opacity: float = 1.0
    mix: tuple[str, float] = ("ffffff", 0.0)  # an sRGB hex and how much of it is mixed in
    # what it is made of, the word of the label `semantics:labels:material`; "" = as the slot is called
    material: str = ""


SLOTS: Mapping[str, Slot] = {
    "wood": Slot("wood", 0.5, "wood", 0.7),
    "front": Slot("front", 0.45, "veneer", 0.9, material="wood"),
    "fabric": Slot("cloth", 0.92, "woven", 0.22),
    "cushion": Slot("cloth", 0.92, "woven", 0.22, mix=("f0e8da", 0.25), material="fabric"),
    "linen": Slot("linen", 0.9, "linen", 0.6),
    "blanket": Slot("blanket", 0.95, "linen", 0.6, material="wool"),
    "metal": Slot("metal", 0.35, "brushed", 0.3, metallic=0.85),
    "ceramic": Slot("ceramic", 0.35, "stone", 0.35),
    "enamel": Slot("f3f2ee", 0.14, material="ceramic"),
    "worktop": Slot("ceramic", 0.3, "stone", 0.35, mix=("b9b3a9", 0.55), material="ceramic"),
    "steel": Slot("b3b5b7", 0.33, "brushed", 0.3, metallic=0.8, material="metal"),
    "leaf": Slot("4f7d3c", 0.6, "leaf", 0.3, material="foliage"),
    "soil": Slot("4a3a2c", 0.95),
    "shade": Slot("f6e7c8", 0.8, material="fabric"),
    "screen": Slot("15171b", 0.12, material="glass"),
    "glass": Slot("dfeae8", 0.08, opacity=0.35),
    "mirror": Slot("c9d2d4", 0.05, metallic=1.0, material="glass"),
    "book": Slot("7a4a40", 0.8, material="paper"),
    "stem": Slot("6b5436", 0.85, material="wood"),
    **{name: Slot("rug", 0.97, name, 0.0, material="wool") for name in RUGS},
    "curtain": Slot("curtain", 0.92, "linen", 0.6, material="linen"),
    "sheer": Slot("curtain", 0.9, "linen", 0.6, opacity=0.6, mix=("ffffff", 0.6), material="linen"),
    "accent_cloth": Slot("accent", 0.95, "knitted", 0.3, material="wool"),
    "accent_plain": Slot("accent", 0.92, "woven", 0.22, material="fabric"),
    **{name: Slot("ffffff", 0.7, name, 0.0, material="print") for name in PICTURES},
    "frame": Slot("wood", 0.45, "wood", 0.7, material="wood"),
    "paper": Slot("f1ede4", 0.9),
    "book_a": Slot("accent", 0.7, "bound", 0.24, material="paper"),
    "book_b": Slot("ceramic", 0.7, "bound", 0.24, material="paper"),
    "book_c": Slot("2f3b45", 0.7, "bound", 0.24, material="paper"),
    "book_d": Slot("cloth", 0.7, "bound", 0.24, material="paper"),
    "petal": Slot("f0dfd5", 0.8, material="foliage"),
    "fruit": Slot("c9862e", 0.5),
    "wax": Slot("f3eadb", 0.5),
    "wicker": Slot("b08a58", 0.9, "wicker", 0.3),
    "leather": Slot("5a3d2b", 0.5, "leather", 0.25),
    "floor": Slot("floor", 0.5, "planks", 1.6, material="wood"),
    "carpet": Slot("curtain", 0.97, "carpet", 1.6, mix=("8d8376", 0.35), material="wool"),
    "tiles": Slot("floor", 0.3, "tiles", 1.6, mix=("e6e1d8", 0.65), material="ceramic"),
    "herringbone": Slot("floor", 0.45, "herringbone", 0.9, material="wood"),
    "terrazzo": Slot("ceramic", 0.25, "terrazzo", 1.2, mix=("e6e1d8", 0.5), material="stone"),
    "wall_tiles": Slot("wall", 0.2, "tiles", 0.8, mix=("f2f0ea", 0.6), material="ceramic"),
    "wall": Slot("wall", 0.92, "plaster", 1.4, material="plaster"),
    "paint": Slot("cloth", 0.92, "plaster", 1.4, mix=("ece7dd", 0.4), material="plaster"),
    "boarding": Slot("wall", 0.6, "boarded", 1.0, mix=("8f9a94", 0.12), material="wood"),
    "brick": Slot("a8745c", 0.95, "brick", 1.0),
    "wallpaper": Slot("wall", 0.9, "papered", 1.4, mix=("8f9a94", 0.22), material="paper"),
}
# What every other style group takes instead.
SECOND = {"wood": "wood2", "cloth": "cloth2", "accent": "blanket", "metal": "metal2"}
SHELL = {"ceiling": "plaster", "trim": "wood", "door_leaf": "wood", "rail": "metal"}  # of the shell alone


def material_of(name: str) -> str:
    """The word of the material that a look is of, by its name, which ends in a slot; raises KeyError for others."""
    words = name.split("_")
    slots = ["_".join(words[start:]) for start in range(len(words))]
    slot = next((slot for slot in slots if slot in SHELL or slot in SLOTS), "")
    return SHELL[slot] if slot in SHELL else SLOTS[slot].material or slot


def metres_of(slot: str) -> float:
    """Metres that one picture covers on a slot, 0 where it fits the whole; 1 for what has none."""
    return SLOTS[slot].metres if slot in SLOTS else 1.0


Color = tuple[float, float, float]


class Harmony(NamedTuple):
    """Colours as sRGB hex, as `harmonies.toml` says which are for what."""

    wall: str
    floor: str
    curtain: str
    linen: str
    wood: str
    wood2: str
    front: str
    cloth: str
    cloth2: str
    rug: str
    blanket: str
    accent: str
    ceramic: str
    metal: str
    metal2: str


TABLE = Path(__file__).parent / "harmonies.toml"
HARMONIES: Mapping[str, Harmony] = {
    name: Harmony(**{word: color for shares in row.values() for word, color in shares.items()})
    for name, row in tomllib.loads(TABLE.read_text("utf-8")).items()
}


def linear(hexadecimal: str) -> Color:
    """`b98f5f` (sRGB) -> linear RGB."""
    red, green, blue = (round(float(v), 5) for v in of_hexadecimal(hexadecimal))
    return red, green, blue


def mixed(first: str, second: str, share: float) -> Color:
    """Linear RGB of two sRGB colours mixed in linear light, `share` of the second."""
    mix = (1 - share) * np.array(linear(first)) + share * np.array(linear(second))
    red, green, blue = (round(float(v), 5) for v in mix)
    return red, green, blue
