"""ADE20K names (the 150 scene-parsing classes) for our categories and for the parts of a room's shell."""

from echomodel.dressing import SMALL
from echomodel.vocabulary import vocabulary
from echousd.graph import Node
from echousd.graph.nodes import OBSTACLE

SHELL = {name: name for name in ("floor", "wall", "ceiling", "door")} | {"beam": "ceiling", "window": "windowpane"}


def word_of(node: Node) -> str:
    """The word for what an object is: its category, or `OBSTACLE` for what stands in the way and is no furniture."""
    return OBSTACLE if node.obstacle else node.category


def ade20k(word: str) -> str:
    """The ADE20K class of a category of the vocabulary or of a part of the shell; raises `UnknownWord`."""
    if word == OBSTACLE:
        return "box"
    if word in SMALL:
        return SMALL[word].ade20k
    return SHELL[word] if word in SHELL else vocabulary().category(word).ade20k
