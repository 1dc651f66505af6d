"""Write a graph in Python, change it, and see what the change does to the room.

python samples/author_graph.py
"""

import echousd
from echousd import Node, Relation, RoomSpec, SceneGraph

graph = SceneGraph(
    room=RoomSpec("study", size=(3.6, 3.0)),
    nodes=(Node("desk", "desk"), Node("chair", "office_chair"), Node("shelf", "bookshelf")),
    relations=(Relation("chair", "close_by", "desk"), Relation("shelf", "taller_than", "desk")),
)
changed = graph.add_node(Node("lamp", "table_lamp")).relate("lamp", "standing_on", "desk")
print("\n".join(graph.diff(changed).lines()))

for version in (graph, changed):
    room = echousd.generate(version, seed=1, shapes="boxes")
    for name, position in zip(room.names, room.boxes.position.tolist(), strict=True):
        print(f"{name:>8} at x {position[0]:+.2f}, height {position[1]:.2f}, z {position[2]:+.2f} m")
    print()
