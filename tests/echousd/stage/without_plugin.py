"""Run by test_stage_roundtrip as a process in which the schema is unknown to USD: one check per line of stdin."""

import json
import sys
import traceback
import warnings

from pxr import Usd

Usd.Stage.CreateInMemory().DefinePrim("/too_early", "Xform")  # from here on USD ignores new schemas

with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import echousd.plugin
assert [w.category for w in caught] == [echousd.plugin.PluginNotActive], caught
assert not echousd.plugin.is_active()

from echousd.graph import SceneGraph  # noqa: E402
from echousd.stage.graphs import save_layer, update_graph  # noqa: E402
from echousd.stage.read import read_graph  # noqa: E402
from echousd.stage.write import graph_layer  # noqa: E402


def check(first: SceneGraph, second: SceneGraph, given: str, made: str) -> None:
    """`given` holds `first`; write it again to `made`, then change it into `second` in memory."""
    assert read_graph(given) == first
    save_layer(graph_layer(first), made)
    assert read_graph(made) == first
    layer = graph_layer(first)
    update_graph(layer, second)
    assert read_graph(Usd.Stage.Open(layer)) == second


for line in sys.stdin:
    task = json.loads(line)
    try:
        check(*(SceneGraph.from_json(text) for text in task["graphs"]), task["given"], task["made"])
        answer = "agreed"
    except Exception:
        answer = traceback.format_exc()
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()
