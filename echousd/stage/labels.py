"""What other people's prims are called: semantics labels, and names where there are none."""

import re
from collections.abc import Iterator

from pxr import Usd

from echomodel.vocabulary import normalised, vocabulary
from echousd.stage.values import texts

LABELS_SCHEMA = "SemanticsLabelsAPI:"
OLD_SCHEMA = "SemanticsAPI:"  # Omniverse before UsdSemantics
STRUCTURE = frozenset(
    {"floor", "wall", "walls", "ceiling", "door", "window", "room", "building", "curtain", "blind", "rug"}
)


def labels(prim: Usd.Prim) -> Iterator[str]:
    """All semantics labels of a prim, those of the taxonomy `category` first."""
    applied = prim.GetPrimTypeInfo().GetAppliedAPISchemas()
    new = [name.removeprefix(LABELS_SCHEMA) for name in applied if name.startswith(LABELS_SCHEMA)]
    for taxonomy in sorted(new, key=lambda name: name != "category"):
        attribute = prim.GetAttribute(f"semantics:labels:{taxonomy}")
        yield from texts(attribute)
    for name in applied:
        if name.startswith(OLD_SCHEMA):
            attribute = prim.GetAttribute(f"semantic:{name.removeprefix(OLD_SCHEMA)}:params:semanticData")
            for found in texts(attribute):
                yield from (word.strip() for word in found.split(","))


def is_floor(prim: Usd.Prim, words: list[str], *, names: bool) -> bool:
    """Whether a prim is a floor by its labels, or by its name where that counts."""
    return "floor" in map(normalised, words) or (names and not words and spaced(prim.GetName()) == "floor")


def category_of_name(prim: Usd.Prim) -> str | None:
    """The category that the asset or the name of a prim tells, None where it tells none or the prim is a group of such.

    `SM_Dining_Chair_03`, `diningChair` and `dining-chair` are all dining chairs.
    """
    model = Usd.ModelAPI(prim)
    found = next(filter(None, map(_category_in, (model.GetAssetName(), prim.GetName()))), None)
    alike = [child for child in prim.GetChildren() if found and _category_in(child.GetName()) == found]
    return None if len(alike) > 1 else found


def _category_in(name: str) -> str | None:
    words = spaced(name).split("_")
    if not STRUCTURE.isdisjoint(words):
        return None
    spans = [(i, k) for i in range(len(words)) for k in range(i + 1, len(words) + 1)]
    spans.sort(key=lambda span: (span[0] - span[1], -span[1]))  # the longest, of these the last
    return next(filter(None, (known_category("_".join(words[i:k])) for i, k in spans)), None)


def spaced(name: str) -> str:
    """A name in lower case, its words apart by underscores, without numbers."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|[^A-Za-z]+", "_", name)
    return apart.strip("_").lower()


def known_category(word: str) -> str | None:
    """The vocabulary's name for a label, None where it has none."""
    row = vocabulary().known_category(word)
    return None if row is None else row.name


def is_structure(word: str) -> bool:
    """Whether a label means a part of a building or a room."""
    return normalised(word) in STRUCTURE or vocabulary().known_room_type(word) is not None
