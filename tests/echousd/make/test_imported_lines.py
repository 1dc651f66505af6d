"""What a default bedroom loads of this project: only what it uses."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
MOST = 25_000  # lines of modules
CODE = """
import sys
from echousd.cli.main import run
assert run(["generate", "samples/bedroom.usda", "-o", sys.argv[1], "--quiet"]) == 0
ours = [m for n, m in sys.modules.items() if n.partition(".")[0] in ("echousd", "echomodel", "echoscene")]
lines = {m.__name__: len(open(m.__file__, encoding="utf-8").readlines()) for m in ours if m.__file__}
for drawn in ("patterns", "pictures"):  # what the first room of a machine draws once
    lines.pop(f"echousd.shapes.finishes.{drawn}", None)
for held in ("furniture.plants", "furniture.bent", "furniture.tufting", "dressing.greenery"):  # some rooms hold such
    lines.pop(f"echomodel.{held}", None)
unused = ("echousd.checks", "echousd.texturing", "echousd.batches", "echousd.exporting", "echousd.settle",
          "echousd.assets.choose", "echousd.assets.record", "echousd.graph.text", "echousd.store",
          "echousd.folder.history", "echousd.folder.interrupted", "echousd.graph.starting", "echousd.stage.contents",
          "echomodel.training",
          "echomodel.metrics", "echomodel.compact.shape", "echomodel.tsdf", "echomodel.furniture.kitchens",
          "echomodel.furniture.kids_beds", "echomodel.rooms.runs", "echomodel.plans",
          "echomodel.rooms.generator", "echomodel.rooms.statistics", "echomodel.roomboxes",
          "echomodel.furniture.distances", "echomodel.furniture.seating", "echomodel.guidance", "echousd.layers.placed",
          "echousd.make.fitting", "echousd.shapes.sources.retrieval",
          "echousd.graph.difference", "echousd.graph.titles", "echousd.cli.plan",
          "echousd.layers.materialx", "echousd.dressing.nodes", "echousd.stage.showing", "echousd.stage.subdivision",
          "echomodel.rules.placements", "echomodel.furniture.cabinets", "echomodel.furniture.drawn",
          "echomodel.objective.fitted", "echomodel.objective.lounging", "echomodel.objective.seating",
          "echomodel.objective.sight", "echousd.place.seats", "echousd.stage.apart", "echousd.draw.outside",
          "echousd.draw.from_files", "echousd.place.conflicts", "echousd.folder.found", "echousd.stage.graphs",
          "echousd.shapes.bays", "echousd.place.building", "echousd.folder.merging", "echousd.invalid",
          "echousd.graph.stated",
          "echoscene", "torch", "trimesh", "networkx", "sklearn", "scipy")
print(sum(lines.values()), [name for name in unused if name in sys.modules])
"""
CHECK = """
import sys
from echousd.cli.main import run
assert run(["check", sys.argv[1]]) == 0
print([name for name in ("torch", "trimesh", "scipy", "networkx", "echousd.place.search") if name in sys.modules])
"""


def test_a_bedroom_loads_what_it_uses(tmp_path):
    command = [sys.executable, "-c", CODE, str(tmp_path / "first")]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)  # leather is baked with scipy, once a machine
    command[3] = str(tmp_path / "bedroom")
    found = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    lines, unused = found.split(maxsplit=1)
    assert unused.strip() == "[]"
    assert 15_000 < int(lines) < MOST
    command[2] = CHECK
    found = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert found.splitlines()[-1] == "[]"
