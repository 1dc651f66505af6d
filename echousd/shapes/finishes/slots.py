"""Material slots of furniture, small things and shell: colour, pattern and gloss; harmonies of colours for them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from echomodel.dressing import PRINTS
from echomodel.files import tables
from echousd.srgb import of_hexadecimal


@dataclass(frozen=True)
class MaterialSlot:
    """How one kind of material looks: a row of `slots.toml`, which says what its words mean."""

    color: str
    roughness: float
    pattern: str = ""
    metres: float = 1.0
    metallic: float = 0.0
    opacity: float = 1.0
    mix: str = "ffffff"
    share: float = 0.0
    material: str = ""
    upright: bool = False
    rows: int = 1


HERE = Path(__file__).parent
_ROWS = {name: MaterialSlot(**row) for name, row in tables("slots.toml", __file__).items()}
SLOTS: Mapping[str, MaterialSlot] = _ROWS | {
    name: replace(_ROWS[name.partition("_")[0]], pattern=name, metres=0.0, rows=row.get("rows", 1))
    for name, row in PRINTS.items()
}
UPRIGHT = frozenset(name for name, slot in SLOTS.items() if slot.upright)
# What every other style group takes instead.
SECOND = {"wood": "wood2", "cloth": "cloth2", "accent": "blanket", "metal": "metal2"}


def material_of(name: str) -> str:
    """The word of the material that a look is of, by its name, which ends in a slot; raises KeyError for others."""
    words = name.split("_")
    slots = ["_".join(words[start:]) for start in range(len(words))]
    slot = next((slot for slot in slots if slot in SLOTS), "")
    return SLOTS[slot].material or slot


def metres_of(slot: str) -> float:
    """Metres that one picture covers on a slot, 0 where it fits the whole; 1 for what has none."""
    return SLOTS[slot].metres if slot in SLOTS else 1.0


Color = tuple[float, float, float]


_TABLE = tables("harmonies.toml", __file__)
FINISHED = {"wood": "wood", "metal": "metal", "plaster": "wall"} | dict.fromkeys(("fabric", "linen", "wool"), "cloth")
FINISHES: Mapping[str, Mapping[str, tuple[float, float]]] = {name: row.pop("finish") for name, row in _TABLE.items()}
# Harmony -> word, as `harmonies.toml` says which are for what -> colour as sRGB hex, in one order.
HARMONIES: Mapping[str, Mapping[str, str]] = {
    name: {word: color for shares in row.values() for word, color in shares.items()} for name, row in _TABLE.items()
}


def finish_of(harmony: str, slot: str) -> tuple[float, float]:
    """What the roughness of a slot is multiplied with in a harmony, and by what share wear makes its tone uneven."""
    return FINISHES[harmony].get(FINISHED.get(material_of(slot), ""), (1.0, 0.0))


def linear(hexadecimal: str) -> Color:
    """`b98f5f` (sRGB) -> linear RGB."""
    red, green, blue = (round(float(v), 5) for v in of_hexadecimal(hexadecimal))
    return red, green, blue


def mixed(first: str, second: str, share: float) -> Color:
    """Linear RGB of two sRGB colours mixed in linear light, `share` of the second."""
    mix = (1 - share) * np.array(linear(first)) + share * np.array(linear(second))
    red, green, blue = (round(float(v), 5) for v in mix)
    return red, green, blue
