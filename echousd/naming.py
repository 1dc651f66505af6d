"""Names as USD takes them, names that nobody has yet, and by which ending of its name a file is read."""

import unicodedata
from collections.abc import Callable, Container
from typing import Literal

TEXT_FORMS: dict[str, Literal["yaml", "json"]] = {".yaml": "yaml", ".yml": "yaml", ".json": "json"}
LAYER_FORMS = (".usda", ".usdc", ".usd")
STAGE_FORMS = (*LAYER_FORMS, ".usdz")
CRATE = b"PXR-USDC"  # how a binary stage begins
HOUSE = "echousd_house"  # in the metadata of a layer that composes rooms
HOME = "home.usda"  # that layer

SPELLED = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "æ": "ae", "ø": "o", "ł": "l"}
)


def in_ascii(word: str) -> str:
    """A word as ASCII spells its letters, without those that it has none for."""
    spelled = unicodedata.normalize("NFC", word).translate(SPELLED)
    return "".join(c for c in unicodedata.normalize("NFKD", spelled) if c.isascii())


def as_identifier(word: str) -> str:
    """A word, such as the name of a file or folder, as a USD identifier."""
    name = "".join(c if c.isalnum() else "_" for c in in_ascii(word))
    name = name if name.strip("_") else "room"
    return name if not name[0].isdigit() else f"_{name}"


def free_name(word: str, taken: Container[str] | Callable[[str], bool]) -> str:
    """The word itself, or the first of `word_2`, `word_3` ... that is not taken."""
    is_taken = taken if callable(taken) else taken.__contains__
    name, number = word, 2
    while is_taken(name):
        name, number = f"{word}_{number}", number + 1
    return name
