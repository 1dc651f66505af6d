"""What is to be changed of a room, in words: what the command line and scripts ask of an edit."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


def _ask(form: str, help: str) -> Any:
    return field(default=(), metadata={"form": form, "help": help})


@dataclass(frozen=True)
class EditRequest:
    """Changes to one room, in the words of the command line; all of a kind are applied in turn, the kinds as here."""

    remove: Sequence[str] = _ask("name", "Object to remove.")
    unrelate: Sequence[str] = _ask("'a left of b'", "Relation to take out.")
    relabel: Sequence[str] = _ask("name:category", "Other category in its place.")
    add: Sequence[str] = _ask("name:category", "Object to add.")
    relate: Sequence[str] = _ask("'a left of b'", "Relation to add.")
    lock: Sequence[str] = _ask("name", "Object that stays as it stands.")
    unlock: Sequence[str] = _ask("name", "Object that may move and change again.")
    move: Sequence[str] = _ask("name:x,z", "Where to, metres; or name:x,y,z.")
    turn: Sequence[str] = _ask("name:degrees", "Heading; 0 looks along +Z.")
    resize: Sequence[str] = _ask("name:x,y,z", "Size at heading 0, metres.")
    reshape: Sequence[str] = _ask("name:file", "Model of your own in its place (USD, glTF, OBJ).")
    restyle: Sequence[str] = _ask("name:style", "Style, of the room as in room:industrial; without a style none.")

    @property
    def folders(self) -> tuple[Path, ...]:
        """Where the models lie that it brings along."""
        return tuple(Path(text.partition(":")[2].strip()).parent for text in self.reshape)
