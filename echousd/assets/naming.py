"""What a model is, by what it is called and how large it is."""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from echomodel.sizes import size_statistics
from echomodel.vocabulary import normalised, vocabulary

LABELLED, CALLED, MEANT, SHELVED = 0.97, 0.9, 0.75, 0.55  # confidence in a category by where its word stands
UNITS = (1.0, 0.01, 0.001, 0.0254)  # metres of units that models come in, the likeliest first
GENERAL = {"table": "table", "sofa": "sofa", "stool": "stool", "double_bed": "bed"}  # what sizes make more particular
OFFICE = {"chair": "office_chair", "dining_table": "desk"}  # what a general word means on the shelf of offices
FITTED = re.compile(r"kitchen|bath ?room|wash ?basin|\bsink\b|\btoilet|ku(e)?che|cuisine|cocina|cucina|keuken|cozinha")
SLACK = 1.6  # how far beyond the sizes that 90 % of real ones have a size is still believed


def category_of(
    labels: Iterable[str], name: str, group: str = "", dims: Sequence[float] | np.ndarray | None = None
) -> tuple[str, float]:
    """(category, confidence) of a model, ("", 0.0) where nothing tells.

    Arguments:
        labels: words of its class, the surest first. name: what it is called. group: the shelf that it lies on.
        dims: (3) metres, where they are known.
    """
    for label in labels:
        bare = re.sub(r"\.[nv]\.\d+$", "", label)  # of WordNet
        found = known_word(bare) or _within(bare)
        if found:
            return _refined(found, dims, group), LABELLED * _likeliness(found, dims)
    size = np.ones(3) if dims is None else dims
    for text, confidence in ((name, CALLED), (group, SHELVED)):
        bare = re.sub(r"[_\-]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z0-9])", " ", text))
        found = known_word(bare) or _translated(bare, group, size)
        found = found or _within(bare, 2) or class_by_name(bare, group, size) or _within(bare)
        if found and fitted(found, text, group):
            return "", 0.0
        if found:
            surely = confidence if known_word(bare) or _within(bare) else min(confidence, MEANT)
            return _refined(found, dims, group), surely * _likeliness(found, dims)
    return "", 0.0


OTHER_GROUPS = ("Vehicles", "Characters", "Doors and windows", "Staircases")  # shelves without furniture of ours


def class_by_name(name: str, group: str, size: Sequence[float] | np.ndarray) -> str:
    """Category for a model's name, group and size (3,) in metres, or "" where it is no furniture of the vocabulary.

    The first pattern of `classes.tsv` that is found in the name tells; where its word ends in ?, the size does.
    """
    text = name.lower()
    width, height, _ = size
    if group in OTHER_GROUPS or (group == "Exterior" and not re.search(r"chair|table|sofa|bench", text)):
        return ""
    word = next((word for word, pattern in _patterns("classes.tsv") if re.search(pattern, text)), "")
    low = "side_table" if width < 0.65 else "coffee_table"
    choice = {
        "bed?": "double_bed" if width >= 1.3 else "single_bed",
        "sofa?": "multi_seat_sofa" if width >= 1.75 else "loveseat_sofa",
        "stool?": "bar_stool" if height > 0.62 else "stool",
        "chair?": "office_chair" if group == "Office" and height > 0.75 else "chair",
        "table?": "dining_table" if height >= 0.62 and width >= 0.7 else low,
        "lamp?": "floor_lamp" if height > 1.0 else "table_lamp",
    }
    return choice.get(word, word)


def _translated(text: str, group: str, size: Sequence[float] | np.ndarray) -> str:
    """The category of a name that is no English one, "" where it is one or means nothing of ours."""
    word = english(text) if FOREIGN.search(text) or not _within(text) else ""
    return (known_word(word) or class_by_name(word, group, size)) if word else ""


def fitted(category: str, *texts: str) -> bool:
    """Whether a piece of storage is a unit of a kitchen or bathroom by its name or shelf, which stands in no other."""
    return vocabulary().category(category).role == "storage" and any(FITTED.search(plain(text)) for text in texts)


@cache
def known_word(text: str) -> str:
    """The category that a text is the name or an alias of, "" where it is none."""
    word, known = re.sub(r"_?\d+$", "", normalised(text)), vocabulary().known_category
    found = known(word) or known(word.removesuffix("s"))
    return found.name if found else ""


def _within(text: str, least: int = 1) -> str:
    """The longest name or alias of a category, of `least` words, in a text; the last where several are as long."""
    words = [word for word in normalised(re.sub(r"\d+", " ", text)).split("_") if word]
    for length in range(min(len(words), 4), least - 1, -1):
        for start in range(len(words) - length, -1, -1):
            found = known_word("_".join(words[start : start + length]))
            if found:
                return found
    return ""


def _refined(category: str, dims: Sequence[float] | np.ndarray | None, group: str) -> str:
    """A general word made as particular as size and shelf allow: a table that nobody can sit at is a coffee table."""
    if dims is not None and category in GENERAL:
        category = class_by_name(GENERAL[category], "", dims) or category
    return OFFICE.get(category, category) if "office" in group.lower() else category


def _likeliness(category: str, dims: Sequence[float] | np.ndarray | None) -> float:
    """1 where a size is one that such furniture has, down to a half where none has."""
    if dims is None:
        return 1.0
    return 1.0 if misfit(category, dims) == 0 else max(0.5, 1.0 - 0.35 * misfit(category, dims))


def misfit(category: str, dims: Sequence[float] | np.ndarray) -> float:
    """How far a size lies beyond those of real furniture of a category, as a logarithm; 0 = within, any heading."""
    table = size_statistics(category)
    low, high = np.log(table.low / SLACK), np.log(table.high * SLACK)
    best = np.inf
    for order in ((0, 1, 2), (2, 1, 0)):
        lengths = np.log(np.maximum(np.asarray(dims, float)[list(order)], 1e-9))
        best = min(best, float(np.maximum(np.maximum(low - lengths, lengths - high), 0).sum()))
    return best


def likely_unit(category: str, extents: Sequence[float] | np.ndarray) -> float | None:
    """Metres of the unit in which a model is likeliest to be drawn, None where none gives a size of such furniture."""
    found = [(misfit(category, np.asarray(extents) * unit), place) for place, unit in enumerate(UNITS)]
    best, place = min(found)
    return UNITS[place] if best < 0.5 else None


FOREIGN = re.compile(
    r"[^\x00-\x7f]|\b(de|da|del|della|di|du|des|d|la|le|il|para|con|mit|fur|aus|van|met|voor|tv.?mobel|meuble|mueble"
    r"|mobile|movel|meubel)\b",
    re.IGNORECASE,
)


def plain(text: str) -> str:
    """A name in small letters without accents, words apart that it joins by capitals, signs or numbers."""
    apart = re.sub(r"(?<=[a-zà-ÿ])(?=[A-Z])", " ", text)
    bare = unicodedata.normalize("NFKD", apart).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z']+", " ", bare).strip()


def english(text: str) -> str:
    """The English name of a piece of furniture with a name in one of the languages, "" where there is none."""
    name = plain(text)
    return next((word for word, pattern in _patterns("words.tsv") if re.search(pattern, name)), "")


@cache
def _patterns(table: str) -> list[tuple[str, str]]:
    """(word, pattern on a name) of a table, of which the first that matches counts; "" = nothing of ours."""
    rows = Path(__file__).with_name(table).read_text("utf-8").splitlines()
    return [(word, pattern) for word, _, pattern in (row.partition("\t") for row in rows)]
