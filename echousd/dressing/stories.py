"""Who lives in a room, and what therefore lies on its furniture, shelves, beds and floor: rows of `stories.toml`."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from echomodel.files import tables
from echomodel.vocabulary import Category
from echousd.graph.fields import RESIDENTS

TABLE = tables("stories.toml", __file__)


@dataclass(frozen=True)
class Wish:
    """A row of `stories.toml`, which says what its words mean."""

    of: tuple[str, ...]
    at: tuple[Any, ...]
    beside: tuple[tuple[str, ...], ...] = ()  # `with`
    by: str = ""
    turn: str = ""
    share: float = 1.0
    needs: str = ""


@dataclass(frozen=True)
class Story:
    """What lies where in the room of somebody."""

    tops: Mapping[str, tuple[Wish, ...]]
    shelves: tuple[str, ...]
    decor: tuple[str, ...]
    boards: tuple[str, ...]
    beds: tuple[Wish, ...]
    seats: tuple[Wish, ...]
    floor: tuple[Wish, ...]
    sills: tuple[Wish, ...]


@cache
def story(resident: str = "") -> Story:
    """The story of one of `RESIDENTS`, of anyone where nobody is told."""
    rows = TABLE["anyone"] | TABLE.get(resident, {})
    tops = TABLE["anyone"]["tops"] | TABLE.get(resident, {}).get("tops", {})
    wishes = {where: tuple(map(_wish, rows[where])) for where in ("beds", "seats", "floor", "sills")}
    shelves, decor, boards = (tuple(rows[where]) for where in ("shelves", "decor", "boards"))
    return Story({top: tuple(map(_wish, of)) for top, of in tops.items()}, shelves, decor, boards, **wishes)


def _wish(row: dict[str, Any]) -> Wish:
    at = (spot for one in row["at"] for spot in (TABLE["places"].get(one, [one]) if isinstance(one, str) else [one]))
    rest = {word: row[word] for word in ("by", "turn", "share", "needs") if word in row}
    return Wish(tuple(row["of"]), tuple(at), tuple(map(tuple, row.get("with", ()))), **rest)


def guessed(room: str, furniture: Iterable[Category]) -> str:
    """Who seems to live in a room of some type with some furniture; "" where nothing tells."""
    words = {word for row in furniture for word in (row.name, row.role)}
    for resident in RESIDENTS:
        story = TABLE[resident]
        if room in story.get("rooms", ()) or any(words.issuperset(signs) for signs in story.get("signs", ())):
            return resident
    return ""
