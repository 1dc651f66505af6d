"""From a graph on a stage to a room on disk.

python samples/make_room.py [GRAPH] [FOLDER]
"""

import sys
from pathlib import Path

import echousd

graph = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "bedroom.usda"
folder = sys.argv[2] if len(sys.argv) > 2 else "out/bedroom"

room = echousd.generate(graph, seed=7)
print(room)
print("saved:", room.save(folder))
for verdict in room.verdicts:
    print(f"{verdict.state:>10}  {verdict.subject} {verdict.predicate} {verdict.object}")
