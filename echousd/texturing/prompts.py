"""Words for painters, from the scene graph: category, style and palette."""

from __future__ import annotations

from echousd.draw.surfaces import Painted, Surfaces


def room_prompt(surfaces: Surfaces) -> str:
    """`a bedroom in oak style, coast colours`: the room, the styles that its graph names, and its palette."""
    kind = _words(surfaces.graph.room.type or "room")
    styles = list(dict.fromkeys(_words(node.style) for node in surfaces.graph.nodes if node.style))
    return ", ".join(filter(None, (_with(kind, styles), _colors(surfaces.palette))))


def object_prompt(thing: Painted, surfaces: Surfaces) -> str:
    """`a nightstand in oak style, coast colours`."""
    kind = _words(thing.category or thing.name)
    return ", ".join(
        filter(None, (_with(kind, [_words(thing.style)] if thing.style else []), _colors(surfaces.palette)))
    )


def _with(kind: str, styles: list[str]) -> str:
    article = "an" if kind[:1] in "aeiou" else "a"
    return f"{article} {kind}" + (f" in {' and '.join(styles[:3])} style" if styles else "")


def _colors(palette: str) -> str:
    return f"{_words(palette)} colours" if palette else ""


def _words(name: str) -> str:
    """A name of the graph as words that are safe in a file's name and in a shell."""
    return " ".join("".join(c if c.isalnum() else " " for c in name).split())[:60]
