"""What is left out where a room may drop pieces: those that stand in a door, never what the room is for."""

import torch

from echomodel.boxes import Boxes
from echomodel.openings import Opening
from echousd.graph import Node, RoomSpec, SceneGraph
from echousd.make.fitting import fitted

DOOR = Opening("door", "door", 0, 0.2, 0.9, 2.0)  # in the wall at -z, from x = -1.8 to -0.9
SPEC = RoomSpec("hallway", size=(4, 3), openings=(DOOR,))


def laid_out(**places):
    """A layout of pieces at (x, z), by name, and how often it was asked for."""
    asked = []

    def arranged(graph):
        asked.append(graph.names)
        sizes = torch.tensor([[0.8, 1.0, 0.3]] * len(graph.nodes))
        at = torch.tensor([[places[name][0], 0.0, places[name][1]] for name in graph.names])
        return [Boxes(sizes, at, torch.zeros(len(graph.nodes)))], ()

    return arranged, asked


def test_what_stands_in_a_door_is_left_out():
    graph = SceneGraph(SPEC, (Node("rack", "coat_rack"), Node("bench", "bench"), Node("cabinet", "shoe_cabinet")))
    arranged, asked = laid_out(rack=(1.4, -1.3), bench=(-1.3, -1.0), cabinet=(1.4, 1.3))
    left, _, said = fitted(graph, arranged)
    assert left.names == ("rack", "cabinet")
    assert said == ("left out: bench, no place for it but in the way of a door",)
    assert asked == [("rack", "bench", "cabinet"), ("rack", "cabinet")]


def test_what_has_a_place_stays():
    bench = Node("bench", "bench", position=(-1.3, 0, -1.0), yaw=0.0)
    arranged, asked = laid_out(bench=(-1.3, -1.0), cabinet=(1.4, 1.3))
    left, _, said = fitted(SceneGraph(SPEC, (bench, Node("cabinet", "shoe_cabinet"))), arranged)
    assert (left.names, said, len(asked)) == (("bench", "cabinet"), (), 1)


def test_what_a_room_is_for_has_the_place_of_what_is_missed_least():
    nodes = [("rack", "coat_rack"), ("cabinet", "shoe_cabinet"), ("bench", "bench"), ("lamp", "ceiling_lamp")]
    graph = SceneGraph(SPEC, tuple(Node(*one) for one in nodes))
    elsewhere = {"cabinet": (1.4, 1.3), "bench": (1.4, 0.0), "lamp": (0.0, 0.0)}

    def arranged(graph):
        free = "bench" not in graph.names
        return laid_out(rack=(1.4, -1.3) if free else (-1.3, -1.0), **elsewhere)[0](graph)

    left, _, said = fitted(graph, arranged)
    assert left.names == ("rack", "cabinet", "lamp")
    assert said == ("left out: bench, no place for it but where rack must stand to leave a door free",)
