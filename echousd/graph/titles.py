"""Names in any script: what a person calls an object is its title, and a USD identifier is made of it."""

import re
import unicodedata
from collections.abc import Container, Mapping
from typing import Any

from echomodel.vocabulary import normalised, vocabulary
from echousd.graph.values import IDENTIFIER, MAX_NAME
from echousd.naming import free_name, in_ascii


def is_title(word: Any) -> bool:
    """Whether a word is a name with letters beyond ASCII: letters, marks, digits, spaces, _, - and '."""
    return (
        isinstance(word, str)
        and any(not c.isascii() and c.isalpha() for c in word)
        and word == word.strip()
        and len(word) <= MAX_NAME
        and all(c in " _-'’" or unicodedata.category(c)[0] in "LMN" for c in word)
    )


def composed(word: Any) -> Any:
    """A text with its letters and marks joined (NFC), so that two ways of writing one name are one; others as are."""
    return unicodedata.normalize("NFC", word) if isinstance(word, str) else word


def identifier_of(title: str, category: str, taken: Container[str]) -> str:
    """A USD identifier for a title that none of `taken` has: its letters in ASCII, or the category where none are."""
    word = re.sub(r"[^A-Za-z0-9_]+", "_", in_ascii(title)).strip("_")
    if not re.search("[A-Za-z]", word):
        word = f"{_plain_category(category)}_{word}".rstrip("_")
    return free_name(word if IDENTIFIER.fullmatch(word) else f"_{word}", taken)


def _plain_category(category: Any) -> str:
    word = normalised(category) if isinstance(category, str) else ""
    row = vocabulary().known_category(word)
    return row.name if row is not None else word if IDENTIFIER.fullmatch(word) else "object"


def name_of(word: Any, names: Mapping[str, str]) -> Any:
    """The name that a title goes by (`names`: title to name); any other value as it is."""
    return names.get(composed(word), word) if isinstance(word, str) else word


def with_names(text: str, names: Mapping[str, str]) -> str:
    """A sentence with identifiers in place of titles (`names`: title to identifier), the longest titles first."""
    for title in sorted(names, key=len, reverse=True):
        if title in text:
            text = re.sub(rf"(?<!\S){re.escape(title)}(?!\S)", names[title], text)
    return text
