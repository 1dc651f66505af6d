"""`ATTRIBUTION.md`: which models of other people a room holds, under which licences, and whose they are."""

from __future__ import annotations

from echousd.room import RoomData
from echousd.shapes.geometry import Origin

FILE = "ATTRIBUTION.md"


def files(room: RoomData) -> dict[str, bytes]:
    """The text, where a room holds models of other people."""
    origins = {name: room.geometry[user].origin for name, user in room.asset_users.items()}
    theirs = {name: origin for name, origin in origins.items() if origin.asset}
    return {FILE: text(room.name, theirs).encode()} if theirs else {}


def text(room: str, origins: dict[str, Origin]) -> str:
    """A table of the models, by licence and author."""
    told = "Made by others, and placed and scaled here; a licence may ask that they are named."
    lines = [f"# Models in {room}", "", told, ""]
    lines += ["| asset | model | licence | author |", "|---|---|---|---|"]
    for name, origin in sorted(origins.items(), key=lambda entry: (entry[1].licence, entry[1].credit, entry[0])):
        cells = (name, origin.asset, origin.licence, origin.credit or "unknown")
        lines.append("| " + " | ".join(_cell(cell) for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(words: str) -> str:
    return " ".join(words.split()).replace("|", "\\|")[:200]
