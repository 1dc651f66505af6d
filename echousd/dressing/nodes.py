"""Small things as nodes of the room's scene graph, with what they stand on and hang over (option `dress_graph`)."""

from collections.abc import Iterable, Mapping

import numpy as np
import shapely
from pxr import Sdf, Vt

from echomodel.boxes2d import CORNERS, turned
from echomodel.dressing import KINDS
from echomodel.floors import AT_WALL
from echomodel.rules import verdicts
from echomodel.vocabulary import vocabulary
from echousd.draw.sight import Furniture
from echousd.dressing.setting import Setting, Standing, Thing
from echousd.graph import Relation
from echousd.graph.dressing import DressingGraph, SmallNode
from echousd.stage import encoding as usd
from echousd.stage.paths import DRESSING, OBJECTS
from echousd.stage.pen import apply_apis
from echousd.stage.write import author_relation, put

MEASURED = ("above", "close_by")  # of what hangs over a piece or lies on the floor at it, the first that holds


def graph_of(setting: Setting, named: Mapping[str, Thing]) -> DressingGraph:
    """The things of one layout as nodes, with a relation of each that belongs to a piece or stands on a wall shelf.

    `setting`: after all rules. `named`: name -> thing.
    """
    nodes = tuple(_node(setting, name, thing) for name, thing in named.items())
    related = (_relation(setting, named, name, thing) for name, thing in named.items() if thing.on)
    return DressingGraph(nodes, tuple(relation for relation in related if relation))


def write_nodes(layer: Sdf.Layer, graph: DressingGraph, room: Sdf.Path, taken: Iterable[str]) -> None:
    """Make the prims of small things nodes, and write their relations below the scene graph.

    `room`: spec path of the room, in a variant where there are several layouts. `taken`: names of the prims of the
    furniture's relations.
    """
    small, names = {node.name for node in graph.nodes}, set(taken)
    above = Sdf.Path(DRESSING).ReplacePrefix(Sdf.Path("/Room"), room)
    for node in graph.nodes:
        spec = layer.GetPrimAtPath(above.AppendChild(node.name))
        apply_apis(spec, *usd.NODE_APIS)
        own = {usd.CATEGORY: node.category, usd.LABELS: Vt.TokenArray([node.category]), usd.SHAPES: usd.DRESSING}
        for attribute, value in (own | usd.values_of(node, usd.NODE_FIELDS)).items():
            put(spec, attribute, value)
    if not graph.relations:
        return
    parent = Sdf.CreatePrimInLayer(layer, room.AppendChild(usd.GRAPH_NAME))
    for relation in graph.relations:
        name = usd.relation_name(*relation.triple, names)
        names.add(name)
        ends = (f"{DRESSING if end in small else OBJECTS}/{end}" for end in (relation.subject, relation.object))
        author_relation(parent, name, relation, *map(Sdf.Path, ends))


def _node(setting: Setting, name: str, thing: Thing) -> SmallNode:
    size, position = (tuple(round(float(v), 5) + 0.0 for v in found) for found in (thing.size, thing.position))
    place = "against_wall" if _hangs(setting, thing) else None
    category, yaw = KINDS[thing.kind].name, round(float(thing.yaw), 6) + 0.0
    return SmallNode(name=name, category=category, size=size, position=position, yaw=yaw, place=place)


def _hangs(setting: Setting, thing: Thing) -> bool:
    """Whether a thing is fixed to a wall behind it."""
    kind = KINDS[thing.kind]
    if not (setting.walls and kind.fixed) or kind.lies:
        return False
    back = turned(thing.size[::2] / 2 * CORNERS[:2], thing.yaw) + thing.position[::2]
    return bool((shapely.distance(setting.room.exterior, shapely.points(back)) <= AT_WALL).all())


def _relation(setting: Setting, named: Mapping[str, Thing], name: str, thing: Thing) -> Relation | None:
    """What a thing is to what it belongs to: it stands on it, or what the vocabulary's rules measure."""
    kind, host = KINDS[thing.kind], setting.objects.get(thing.on)
    if host is None:  # a shelf on a wall is no piece of furniture, but a thing itself
        board = setting.carriers[thing.on]
        whose = next(n for n, t in named.items() if np.array_equal(t.position, board.position))
        return Relation(name, "standing_on", whose)
    if (kind.lies or not kind.fixed) and thing.position[1] > 0.0:
        return Relation(name, "standing_on", host.name)
    return next((Relation(name, word, host.name) for word in MEASURED if _holds(word, thing, host)), None)


def _holds(predicate: str, thing: Thing, host: Standing) -> bool:
    size, position = np.stack([thing.size, host.size]), np.stack([thing.position, host.position])
    both = Furniture(size, position, np.array([thing.yaw, host.yaw]))
    return bool(verdicts(both, np.array([[0, vocabulary().predicate_id(predicate), 1]]))[0] == 1)
