"""Where the processor's seconds of a cold command go: a room stage by stage, what is done with it, then warm calls.

    python benchmarks/cold.py [samples/bedroom.usda] [--rounds 3]

Every row is the least of several new processes, user and system seconds of all threads, and how often a matrix product
of 2048 x 2048 on one thread fits in it, measured in the same run: other work on the machine changes both alike. Then
counts that no machine changes: modules and lines imported, prims, files and bytes written.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

COLD = """
import json, sys, time
begun, time.perf_counter = time.process_time(), time.process_time
from echousd.cli.main import main
told, sys.argv = sys.argv[1], ["echousd", *sys.argv[2:]]
try:
    main()
except SystemExit as ended:
    code = ended.code
ours = [m.__file__ for n, m in sys.modules.items() if n.split(".")[0] in ("echousd", "echomodel") and m.__file__]
counts = {"modules": len(sys.modules), "of ours": len(ours), "lines of ours": sum(len(open(f).readlines()) for f in ours
          if f.endswith(".py"))} | {name: name in sys.modules for name in ("torch", "trimesh", "scipy", "networkx")}
open(told, "w").write(json.dumps({"start": begun, "end": time.process_time(), **counts}))
sys.exit(code)
"""
WARM = """
import sys, time, echousd
from pathlib import Path
from pxr import Usd
from echousd.checks.report import check
def told(name, work):
    started = time.process_time()
    found = work()
    print(name, round(time.process_time() - started, 3), flush=True)
    return found
folder = Path(sys.argv[2])
for number, seed in enumerate((7, 8, 8)):
    room = told(f"generate seed {seed}", lambda: echousd.generate(sys.argv[1], seed=seed, progress=None))
    told("save with its picture", lambda: room.save(folder / str(number)))
root = next((folder / "2").glob("*.usda"))
for _ in range(2):
    told("check", lambda: check(root))
"""
PRODUCT = """
import time, torch
torch.set_num_threads(1)
a = torch.randn(2048, 2048)
def once():
    started = time.process_time(); a @ a
    return time.process_time() - started
print(min(once() for _ in range(7)))
"""


def run(code: str, *words: str) -> tuple[float, str]:
    """Seconds of the processor of a new process, and what it prints."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime, done.stdout


def stages(graph: str, place: Path) -> tuple[dict[str, float], dict[str, float]]:
    """Seconds of each stage of a cold room, and the counts."""
    words = ["generate", graph, "-o", str(place / "room"), "--seed", "7", "--force", "--json"]
    whole, told = run(COLD, str(place / "told.json"), *words)
    seconds = json.loads(told)["timings"]
    counts = json.loads((place / "told.json").read_text())
    start, end, total = counts.pop("start"), counts.pop("end"), seconds.pop("total")
    files = [path for path in (place / "room").rglob("*") if path.is_file()]
    counts |= {"files": len(files), "kB": sum(path.stat().st_size for path in files) // 1000}
    return {"python": start, "command line": end - start - total, **seconds, "exit": whole - end, "all": whole}, counts


def main() -> None:
    """Print the tables."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("graph", nargs="?", default=str(Path(__file__).parents[1] / "samples" / "bedroom.usda"))
    words.add_argument("--rounds", type=int, default=3)
    asked = words.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # installed packages have their byte code
    with tempfile.TemporaryDirectory() as folder:
        place, product = Path(folder), float("inf")
        commands = {"--help": "--help", "check": f"check {place}/room", "doctor": "doctor"}
        commands |= {f"export {kind}": f"export {place}/room -o {place}/r.{kind} --force" for kind in ("usdz", "glb")}
        commands |= {"render": f"render {place}/room -o {place}/r.png --force"}
        least: dict[str, float] = {}
        for _ in range(asked.rounds):
            product = min(product, float(run(PRODUCT)[1]))
            seconds, counts = stages(asked.graph, place)
            seconds |= {name: run(COLD, str(place / "told.json"), *line.split())[0] for name, line in commands.items()}
            least |= {name: min(value, least.get(name, value)) for name, value in seconds.items()}
        print(f"matrix product {product:.3f} s\n\n| | CPU s | products |\n|---|---|---|")
        for name, value in least.items():
            print(f"| {name} | {value:.2f} | {value / product:.1f} |")
        print(", ".join(f"{name} {value}" for name, value in counts.items()))
        print(run(WARM, asked.graph, folder)[1])


if __name__ == "__main__":
    main()
