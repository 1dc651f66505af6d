"""Two ways to furniture made of parts: descriptions that a program builds (a), or its solids one by one (b).

    python benchmarks/parts_ways.py SET --tokens runs/tokens/weights.safetensors [--parts WEIGHTS] [-o FOLDER]

SET is a folder of `echomodel.data.tokenset.build_tokens` (seed 1), for the judge of style. Both ways furnish the same
boxes; beside them stand (b) without its snapping and what the programs themselves draw. Sheets go to FOLDER.
"""

from __future__ import annotations

import argparse
import json
import time
from importlib import resources
from pathlib import Path

from echomodel.compact.model import load_weights
from echomodel.data.sheet import contact_sheet
from echomodel.data.tokenset import TokenSet
from echomodel.echo import EchoModel
from echomodel.files import write_json, write_picture
from echomodel.metrics.parts_evaluation import PartsEvaluation
from echomodel.metrics.style_judge import trained_judge
from echomodel.metrics.ways_evaluation import Described, Tokens, Way, drawn, evaluate_way


def main() -> None:
    """Score the ways and print a table as JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set", type=Path)
    parser.add_argument("--tokens", type=Path, required=True)
    parser.add_argument("--parts", type=Path)
    parser.add_argument("--per-class", type=int, default=8)
    parser.add_argument("--suites", type=int, default=64)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("-o", "--out", type=Path, default=Path("out/ways"))
    asked = parser.parse_args()
    latent = Path(str(resources.files("echomodel") / "weights" / "layout.safetensors"))
    judge, known = trained_judge(TokenSet.load(asked.set), seed=1)
    print(json.dumps({"judge": known}), flush=True)
    tokens = EchoModel(*load_weights([latent, asked.tokens]))
    parts = EchoModel.load(None) if asked.parts is None else EchoModel(*load_weights([latent, asked.parts]))
    ways: dict[str, Way] = {
        "programs": drawn, "a": Described(parts), "b": Tokens(tokens), "b_unsnapped": Tokens(tokens, snap=False)
    }  # fmt: skip
    settings = PartsEvaluation(per_class=asked.per_class, suites=asked.suites, seed=asked.seed)
    asked.out.mkdir(parents=True, exist_ok=True)
    results = {}
    for name, way in ways.items():
        began = time.process_time()
        results[name], meshes = evaluate_way(way, judge, settings)
        results[name]["seconds"] = round(time.process_time() - began, 1)
        print(json.dumps({name: results[name]}), flush=True)
        sheet = contact_sheet([(word, meshes[word]) for word in sorted(meshes)])
        write_picture(asked.out / f"{name}.png", sheet)
    write_json(asked.out / "ways.json", {"judge": known, **results})


if __name__ == "__main__":
    main()
