"""Fixtures for all tests."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import pytest
from forked_reader import readers_are_forked
from hypothesis import HealthCheck, settings

# Every process that a test starts would compile all modules anew, and every run rewrite all tests.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Busy machines draw examples slowly, which says nothing about the code.
settings.register_profile("project", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("project")


SLOW = Path(__file__).with_name("slow.txt").read_text("utf-8").split()  # left out by `make quick`; the dearest first


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--quick", action="store_true", help="leave out the files that tests/slow.txt names")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    slow = collection_path.is_file() and collection_path.relative_to(Path(__file__).parent).as_posix() in SLOW
    return True if slow and config.getoption("--quick") else None


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """What tests import stays till the end: no search for garbage goes through it, and searches are fewer."""
    gc.disable()
    gc.set_threshold(20_000, 20)
    found = yield
    gc.freeze()
    gc.enable()
    return found


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Dear files begin first, so that no worker ends the run alone with one (with `--no-loadscope-reorder`)."""
    place = {f"tests/{file}": number for number, file in enumerate(SLOW)}
    items.sort(key=lambda item: place.get(item.nodeid.partition("::")[0], len(place)))


@pytest.fixture(autouse=True, scope="session")
def disks_are_not_waited_for() -> Iterator[None]:
    """Files reach the disk when the system likes: a machine that loses its power is no part of a test."""
    with patch.object(os, "fsync", lambda file: None):
        yield


@pytest.fixture(autouse=True, scope="session")
def readers_begin_soon() -> Iterator[None]:
    """Files of others are read by forks of one process; a test of how it begins wants `apart.subprocess` itself."""
    with readers_are_forked():
        yield


@pytest.fixture(autouse=True)
def models_are_loaded_anew(request: pytest.FixtureRequest) -> Iterator[None]:
    """A test that replaces something meets no model that was loaded before, and leaves none to others."""
    replaces = "monkeypatch" in request.fixturenames
    loading = sys.modules.get("echomodel.loading")
    if replaces and loading is not None:
        loading._loaded.cache_clear()
    yield
    loading = sys.modules.get("echomodel.loading")
    if replaces and loading is not None:
        loading._loaded.cache_clear()


@pytest.fixture(scope="session")
def loaded_by() -> Callable[..., set[str]]:
    """Names of all modules that some code loads in a process of its own: `loaded_by("import echousd")`."""

    def call(code: str, *words: object) -> set[str]:
        told = f"{code}\nimport sys; print(*sys.modules)"
        command = [sys.executable, "-c", told, *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return set(done.stdout.splitlines()[-1].split())

    return call


@dataclass(frozen=True)
class Outcome:
    """What one command line did."""

    code: int
    out: str
    err: str


@pytest.fixture
def echousd_command(capsys: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Run `echousd` with the given words in this process: `echousd_command("graph", path).code`."""
    from echousd.cli.main import run

    def call(*words: object) -> Outcome:
        capsys.readouterr()
        code = run([str(word) for word in words])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call
