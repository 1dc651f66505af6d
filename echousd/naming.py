"""Names as USD takes them, and names that nobody has yet."""

from __future__ import annotations

from collections.abc import Callable, Container

HOUSE = "echousd_house"  # in the metadata of a layer that composes rooms
HOME = "home.usda"  # that layer


def as_identifier(word: str) -> str:
    """A word, such as the name of a file or folder, as a USD identifier."""
    name = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in word) or "room"
    return name if not name[0].isdigit() else f"_{name}"


def free_name(word: str, taken: Container[str] | Callable[[str], bool]) -> str:
    """The word itself, or the first of `word_2`, `word_3` ... that is not taken."""
    is_taken = taken if callable(taken) else taken.__contains__
    name, number = word, 2
    while is_taken(name):
        name, number = f"{word}_{number}", number + 1
    return name
