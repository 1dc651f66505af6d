"""Which faults the tests notice: one small change of the code at a time, and the tests of its group.

    python tests/mutants.py GROUP [--count 30] [--seed 0]       GROUP: rules, graph, stage, edit, folder, layers

A comparison, a sign, a number, `and` for `or`, `max` for `min`, a condition turned round, a statement or a returned
value left out: places are drawn by lot, of every module of the group. The change is made in a copy of the tree. Prints
a line for every change that survived and the share that was killed; exit code 1 below four in five.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

TOP = Path(__file__).parents[1]
GROUPS = {  # modules, and what tests them
    "rules": ("model/echomodel/rules", ["echomodel/test_rules.py", "echomodel/test_placement_rules.py",
                                        "echomodel/test_turned_relations.py"]),
    "graph": ("echousd/graph", ["echousd/graph"]),
    "stage": ("echousd/stage", ["echousd/stage"]),
    "edit": ("echousd/make/edit.py", ["echousd/make/test_room_edit.py"]),
    "folder": ("echousd/folder", ["echousd/folder"]),
    "layers": ("echousd/layers", ["echousd/layers"]),
}  # fmt: skip
WANTED = 0.8
SECONDS = 300  # that the tests may take; what takes longer is noticed
TURNED = {ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
          ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.Add: ast.Sub,
          ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}  # fmt: skip
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}
# The installed package must not be found before the copy.
BOOT = (
    "import sys; sys.meta_path[:] = [f for f in sys.meta_path if 'editable' not in getattr(f, '__module__', '')]; "
    "sys.path[:0] = [{top!r}, {top!r} + '/model']; import pytest; sys.exit(pytest.main(sys.argv[1:]))"
)


def changes(tree: ast.Module) -> Iterator[tuple[ast.AST, str, object]]:
    """Every change of a module: a node, its field and what is put there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            yield node, "ops", [TURNED[type(node.ops[0])](), *node.ops[1:]]
        elif isinstance(node, ast.BinOp | ast.BoolOp) and type(node.op) in TURNED:
            yield node, "op", TURNED[type(node.op)]()
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield node, "value", node.value + 1
        elif isinstance(node, ast.Name) and node.id in NAMES:
            yield node, "id", NAMES[node.id]
        elif isinstance(node, ast.If | ast.IfExp):
            yield node, "test", ast.UnaryOp(ast.Not(), node.test)
        elif isinstance(node, ast.Return) and node.value is not None:
            yield node, "value", ast.Constant(None)
        for name in ("body", "orelse"):
            for place, one in enumerate(getattr(node, name, ()) if isinstance(node, ast.stmt) else ()):
                told = isinstance(one, ast.Expr) and not isinstance(one.value, ast.Constant)
                if told or isinstance(one, ast.AugAssign | ast.Raise):
                    whole = getattr(node, name)
                    yield node, name, [*whole[:place], ast.Pass(), *whole[place + 1 :]]


def mutant(source: str, number: int) -> tuple[int, str, str]:
    """The line of change `number` of a module, what it was and became, and the changed module."""
    tree = ast.parse(source)
    node, name, new = list(changes(tree))[number]
    before = ast.unparse(node).splitlines()[0]
    setattr(node, name, new)
    after = ast.unparse(node).splitlines()[0]
    if before == after:
        after = f"{after} ({name})"
    return node.lineno, f"{before} -> {after}"[:150], ast.unparse(ast.fix_missing_locations(tree))


def noticed(copy: Path, tests: list[str]) -> bool:
    """Whether the tests of a copied tree fail."""
    words = [sys.executable, "-c", BOOT.format(top=str(copy)), "-x", "-q", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": ""}
    try:
        ran = subprocess.run(words, cwd=copy, env=environment, capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return True
    return ran.returncode != 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("group", choices=sorted(GROUPS))
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    where, tests = GROUPS[options.group]
    modules = [TOP / where] if where.endswith(".py") else sorted((TOP / where).glob("*.py"))
    places = [(path, n) for path in modules for n in range(len(list(changes(ast.parse(path.read_text())))))]
    chosen = random.Random(options.seed).sample(places, min(options.count, len(places)))
    killed = 0
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        copy = Path(name)
        for part in ("echousd", "model", "schemas", "samples", "tests", "docs", "benchmarks"):
            shutil.copytree(TOP / part, copy / part, ignore=shutil.ignore_patterns("__pycache__"))
        for file in ("pyproject.toml", "README.md"):
            shutil.copy(TOP / file, copy / file)
        (copy / "echousd/schemas").symlink_to(copy / "schemas")
        if noticed(copy, [f"tests/{test}" for test in tests]):
            raise SystemExit("the tests fail without any change")
        for path, number in chosen:
            source, target = path.read_text(), copy / path.relative_to(TOP)
            line, told, changed = mutant(source, number)
            target.write_text(changed)
            if noticed(copy, [f"tests/{test}" for test in tests]):
                killed += 1
            else:
                print(f"survived {path.relative_to(TOP)}:{line}: {told}", flush=True)  # noqa: T201
            target.write_text(source)
    print(f"{options.group}: {killed} of {len(chosen)} killed")  # noqa: T201
    if killed < WANTED * len(chosen):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
