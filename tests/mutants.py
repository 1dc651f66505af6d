"""Which faults the tests notice: one small change of the code at a time, and the tests of its group.

    python tests/mutants.py GROUP [--count 30] [--seed 0]       GROUP: rules, graph, stage, edit, folder, layers

A comparison, a sign, a number, `and` for `or`, `max` for `min`, a condition turned round, a statement or a returned
value left out: places are drawn by lot, of every module of the group. The change is made in a copy of the tree. Prints
a line for every change that survived and the share that was killed; exit code 1 below four in five.

The tests are collected once. A first run, in a fork, finds which tests run each line; then every change has a fork of
its own, where the changed functions get their new code and the tests of the line run, quick ones first, until one
fails. What is outside functions (tables, defaults) is met by a process of its own.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import functools
import gc
import io
import itertools
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest

TOP = Path(__file__).parents[1]
GROUPS = {  # modules, and what tests them
    "rules": ("model/echomodel/rules", ["echomodel/test_rules.py", "echomodel/test_rules_arrays.py",
                                        "echomodel/test_placement_rules.py", "echomodel/test_turned_relations.py"]),
    "graph": ("echousd/graph", ["echousd/graph"]),
    "stage": ("echousd/stage", ["echousd/stage"]),
    "edit": ("echousd/make/edit.py echousd/make/furnishing.py",
             ["echousd/make/test_room_edit.py", "echousd/make/test_following.py"]),
    "folder": ("echousd/folder", ["echousd/folder"]),
    "layers": ("echousd/layers", ["echousd/layers"]),
}  # fmt: skip
WANTED = 0.8
QUICK, LONG = 1.0, 15.0  # seconds of the processor: a test that comes first, one that is left out
IMPORT = "import"  # in place of a test: lines that run before any
TIMES = itertools.count(int(time.time()) + 1)
SECONDS = 600  # that the tests of one change may take; what takes longer is noticed
TURNED = {ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
          ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.Add: ast.Sub,
          ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And}  # fmt: skip
NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}
# No editable installation comes before the copy, as that of new setuptools does.
COPY = "import sys; sys.meta_path[:] = [m for m in sys.meta_path if getattr(m, '__name__', '') != '_EditableFinder']"
# A failing example of hypothesis need not be made small, and the next change shall not meet it.
PROFILE = f"{COPY}; from hypothesis import HealthCheck, Phase, settings; settings.register_profile('mutants', \
deadline=None, suppress_health_check=[HealthCheck.too_slow], phases=(Phase.explicit, Phase.generate), database=None, \
derandomize=True)"


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
        elif isinstance(node, ast.Return) and not (node.value is None or getattr(node.value, "value", 0) is None):
            yield node, "value", ast.Constant(None)
        for name in ("body", "orelse"):
            for place, one in enumerate(getattr(node, name, ()) if isinstance(node, ast.stmt) else ()):
                told = isinstance(one, ast.Expr) and not isinstance(one.value, ast.Constant)
                if told or isinstance(one, ast.AugAssign | ast.Raise):
                    whole = getattr(node, name)
                    yield node, name, [*whole[:place], ast.Pass(), *whole[place + 1 :]]


@dataclass(frozen=True)
class Mutant:
    """One change: where it is, what is printed of it, the changed module, and the lines whose tests may notice it."""

    path: Path
    line: int
    told: str
    tree: ast.Module
    lines: range | None  # None: outside functions


def mutant(path: Path, number: int) -> Mutant:
    """Change `number` of a module."""
    tree = ast.parse(path.read_text())
    node, name, new = list(changes(tree))[number]
    old = getattr(node, name)
    at: Any = next((a for a, b in zip(old, new, strict=True) if isinstance(b, ast.Pass)), node) \
        if name in ("body", "orelse") else node  # fmt: skip
    before = ast.unparse(at).splitlines()[0]
    lines = _lines(tree, at)
    if at is not node:
        ast.copy_location(next(one for one in new if isinstance(one, ast.Pass)), at)
    setattr(node, name, new)
    after = "pass" if at is not node else ast.unparse(node).splitlines()[0]
    if before == after:
        after = f"{after} ({name})"
    return Mutant(path, at.lineno, f"{before} -> {after}"[:150], ast.fix_missing_locations(tree), lines)


def _lines(tree: ast.Module, at: Any) -> range | None:
    """The lines of the innermost statement that holds a node, without the statements in it; None outside functions."""
    inside, found = False, None
    for node in ast.walk(tree):  # outer nodes come first
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and _holds(node.body[0], node.body[-1], at):
            inside = True
        if isinstance(node, ast.stmt) and _holds(node, node, at):
            found = node
    if not inside or found is None:
        return None
    body = getattr(found, "body", None)
    last = body[0].lineno - 1 if body and body[0].lineno > found.lineno else found.end_lineno
    return range(found.lineno, (last or found.lineno) + 1)


def _holds(first: Any, last: Any, at: Any) -> bool:
    begin, end = (first.lineno, first.col_offset), (last.end_lineno, last.end_col_offset)
    return begin <= (at.lineno, at.col_offset) and (at.end_lineno, at.end_col_offset) <= end


class Record:
    """What a first run finds out: which tests run each line, and what each takes."""

    def __init__(self, files: Sequence[str]) -> None:
        self.files = frozenset(files)
        self.tests: defaultdict[str, set[str]] = defaultdict(set)  # "file:line" -> tests, or their file
        self.seconds: dict[str, float] = {}
        self.apart: set[str] = set()  # tests that start other processes, which may run any line
        self.now = IMPORT

    def trace(self, frame: FrameType, event: str, arg: object) -> Any:
        return self.local if frame.f_code.co_filename in self.files else None

    def local(self, frame: FrameType, event: str, arg: object) -> Any:
        if event == "line":
            self.tests[f"{frame.f_code.co_filename}:{frame.f_lineno}"].add(self.now)
        return self.local

    def audit(self, event: str, arguments: object) -> None:
        if event in ("subprocess.Popen", "os.fork", "os.posix_spawn"):
            self.apart.add(self.now)

    def write(self, path: Path) -> None:
        tests = {line: sorted(names) for line, names in self.tests.items()}
        path.write_text(json.dumps({"tests": tests, "seconds": self.seconds, "apart": sorted(self.apart)}))


class Loop:
    """In place of pytest's loop: the first run and every change, each in a fork."""

    def __init__(self, copy: Path, mutants: Sequence[Mutant], words: list[str]) -> None:
        self.copy, self.mutants, self.words = copy, mutants, words
        self.survived: list[str] = []
        self.broken = ""
        self.record: Record | None = Record([str(copy / one.path.relative_to(TOP)) for one in mutants])
        sys.settrace(self.record.trace)

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> Iterator[None]:
        if self.record is not None:  # a fixture of a file serves all its tests
            self.record.now = item.nodeid.partition("::")[0]
        yield
        if self.record is not None:
            self.record.now = item.nodeid

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if session.testsfailed:
            self.broken = "the tests cannot be collected"
            return True
        sys.settrace(None)
        gc.unfreeze()  # what `conftest.py` keeps from searches is looked through for functions
        notes = self.copy / "record.json"
        if _forked(lambda: self.first(session, notes), 6 * SECONDS):
            self.broken = "the tests fail without any change"
            return True
        self.record, found = None, json.loads(notes.read_text())
        if not found["tests"]:
            self.broken = "no test runs anything of these modules: another copy of them is imported"
            return True
        took, apart = found["seconds"], set(found["apart"])
        for number, one in enumerate(self.mutants):
            target = self.copy / one.path.relative_to(TOP)
            names = {name for line in one.lines or () for name in found["tests"].get(f"{target}:{line}", ())}
            alone = not one.lines or names == {IMPORT}
            if alone:  # all tests that run anything of the module, and those of files that read its tables
                names = {
                    name for line in found["tests"] if line.startswith(f"{target}:") for name in found["tests"][line]
                }
                module = ".".join(one.path.relative_to(TOP).with_suffix("").parts).removeprefix("model.")
                names |= {name.partition("::")[0] for name in took if module in _text(name.partition("::")[0])}
            chosen = {name for name in took if (names | apart) & {name, name.partition("::")[0]}}
            items = [item for item in session.items if item.nodeid in chosen and took[item.nodeid] < LONG]
            total: defaultdict[str, float] = defaultdict(float)
            for item in items:
                total[str(item.path)] += took[item.nodeid]
            items.sort(key=lambda item: (took[item.nodeid] > QUICK, item.nodeid in apart, total[str(item.path)]))
            source, began = target.read_text(), time.monotonic()
            _write(target, ast.unparse(one.tree))  # what other processes read
            try:
                noticed = bool(items) and self.noticed(session, one, items, str(target), sum(total.values()), alone)
            finally:
                _write(target, source)
            told = f"{number}: {one.path.relative_to(TOP)}:{one.line}: {one.told}"
            said = "killed" if noticed else "survived"
            print(f"{said} {told} ({len(items)} tests, {time.monotonic() - began:.0f} s)", flush=True)  # noqa: T201
            if not noticed:
                self.survived.append(told)
        return True

    def first(self, session: pytest.Session, notes: Path) -> bool:
        """Run everything once, unchanged, and write down what is found out; whether a test fails."""
        _silence(session)
        record, last = self.record, None
        assert record is not None
        sys.addaudithook(record.audit)
        threading.settrace(record.trace)
        sys.settrace(record.trace)
        for item, after in zip(session.items, [*session.items[1:], None], strict=True):
            if item.path != last:
                _forget()
            last, before = item.path, time.process_time()
            item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)
            record.seconds[item.nodeid] = time.process_time() - before
            if session.testsfailed:
                print(f"fails unchanged: {item.nodeid}", file=sys.__stderr__)
                return True
        sys.settrace(None)
        record.write(notes)
        return False

    def noticed(
        self, session: pytest.Session, one: Mutant, items: list[pytest.Item], target: str, seconds: float, alone: bool
    ) -> bool:
        """Whether a test fails."""
        if alone:
            return _apart(self.copy, [*self.words, *(item.nodeid for item in items)])

        def run() -> bool:
            resource.setrlimit(resource.RLIMIT_CPU, (int(30 + 3 * seconds), resource.RLIM_INFINITY))
            _silence(session)
            _put(one.tree, target)
            for item, after in zip(items, [*items[1:], None], strict=True):
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)
                if session.testsfailed:
                    return True
            return False

        return _forked(run)


def _write(path: Path, text: str) -> None:
    """A module that no byte code of another version passes for, whatever its size: each has a time of its own."""
    path.write_text(text)
    stamp = next(TIMES)
    os.utime(path, (stamp, stamp))


@functools.cache
def _text(file: str) -> str:
    """A file of tests, below the folder of the run."""
    return Path(file).read_text("utf-8")


def _silence(session: pytest.Session) -> None:
    """No dots of this process."""
    session.config.pluginmanager.get_plugin("terminalreporter")._tw._file = io.StringIO()


def _forget() -> None:
    """Empty every cache, so that each file of tests runs what it needs."""
    for one in gc.get_objects():
        if type(one) is functools._lru_cache_wrapper and one.__module__.split(".")[0] in ("small_room", "echousd"):
            one.cache_clear()


def _put(tree: ast.Module, file: str) -> None:
    """Give the functions of a module their changed code."""

    def codes(code: CodeType) -> Iterator[CodeType]:
        yield code
        for one in code.co_consts:
            if isinstance(one, CodeType):
                yield from codes(one)

    new = {(code.co_qualname, code.co_firstlineno): code for code in codes(compile(tree, file, "exec"))}
    for one in gc.get_objects():
        if type(one) is FunctionType and one.__code__.co_filename == file:
            one.__code__ = new.get((one.__code__.co_qualname, one.__code__.co_firstlineno), one.__code__)


def _forked(run: Any, seconds: int = SECONDS) -> bool:
    """Whether `run` says yes, fails or takes longer than some seconds, in a fork whose words nobody reads."""
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        signal.alarm(seconds)
        failed = True
        try:
            failed = run()
        finally:
            os._exit(int(failed))
    _, status = os.waitpid(child, 0)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)  # what the tests left running
    return status != 0


def _apart(copy: Path, words: list[str]) -> bool:
    """Whether tests fail in a process of their own."""
    told = [sys.executable, "-c", f"{PROFILE}; import sys, pytest; sys.exit(pytest.main(sys.argv[1:]))", "-x", *words]
    try:
        return subprocess.run(told, cwd=copy, capture_output=True, timeout=SECONDS, check=False).returncode != 0
    except subprocess.TimeoutExpired:
        return True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("group", choices=sorted(GROUPS))
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of those drawn")
    parser.add_argument("--tests", nargs="*", help="files below tests/ in place of the group's")
    options = parser.parse_args()
    where, tests = GROUPS[options.group]
    tests = [f"tests/{test}" for test in options.tests or tests]
    modules = [TOP / file for file in where.split()] if ".py" in where else sorted((TOP / where).glob("*.py"))
    places = [(path, n) for path in modules for n in range(len(list(changes(ast.parse(path.read_text())))))]
    chosen = random.Random(options.seed).sample(places, min(options.count, len(places)))
    if options.only:
        chosen = [chosen[number] for number in options.only]
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        copy = Path(name).resolve()
        for part in ("echousd", "model", "schemas", "samples", "tests", "docs", "benchmarks"):
            shutil.copytree(TOP / part, copy / part)
        for file in ("pyproject.toml", "README.md"):
            shutil.copy(TOP / file, copy / file)
        shutil.rmtree(copy / "echousd/schemas", ignore_errors=True)
        (copy / "echousd/schemas").symlink_to(copy / "schemas")
        ways = [str(copy), str(copy / "model")]
        os.environ |= {"OMP_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1", "PYTHONDONTWRITEBYTECODE": "1",
                       "PYTHONPATH": os.pathsep.join(ways)}  # fmt: skip
        os.chdir(copy)
        sys.path[:] = [*ways, *(way for way in sys.path if not Path(way).resolve().is_relative_to(TOP / "tests"))]
        exec(PROFILE, {})
        words = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--disable-warnings", "--hypothesis-profile=mutants",
                 f"--basetemp={copy / 'temporary'}"]  # fmt: skip
        loop = Loop(copy, [mutant(path, number) for path, number in chosen], words)
        pytest.main([*words, *tests], plugins=[loop])
        os.chdir(TOP)
    if loop.broken:
        raise SystemExit(loop.broken)
    killed = len(chosen) - len(loop.survived)
    print(f"{options.group}: {killed} of {len(chosen)} killed", *loop.survived, sep="\n")  # noqa: T201
    if killed < WANTED * len(chosen):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
