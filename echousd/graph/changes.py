"""What is to be changed of a room, in words: what the command line and scripts ask of an edit."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any


def _ask(help: str) -> Any:
    return field(default=(), metadata={"help": help})


@dataclass(frozen=True)
class EditRequest:
    """Changes to one room, in the words of the command line; all of a kind are applied in turn, the kinds as here."""

    remove: Sequence[str] = _ask("Object to remove.")
    unrelate: Sequence[str] = _ask("Relation to take out.")
    relabel: Sequence[str] = _ask("Other category in its place, name:category.")
    add: Sequence[str] = _ask("Object to add, as name:category.")
    relate: Sequence[str] = _ask('Relation to add: "stool close by bed".')
    lock: Sequence[str] = _ask("Object that stays as it stands.")
    unlock: Sequence[str] = _ask("Object that may move and change again.")
    move: Sequence[str] = _ask("Where to, name:x,z or name:x,y,z, metres.")
    turn: Sequence[str] = _ask("Heading, name:degrees; 0 looks along +Z.")
    resize: Sequence[str] = _ask("Size at heading 0, name:x,y,z, metres.")
    reshape: Sequence[str] = _ask("Model of your own in its place, name:file (USD, glTF, OBJ).")
    restyle: Sequence[str] = _ask("Style, name:style, or room:industrial; without a style none.")
