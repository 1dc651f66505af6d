"""How the package is installed: no folder of its name hides it, and its types are told."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from setuptools.dist import Distribution

ROOT = Path(__file__).parents[1]


def test_a_clone_called_echousd_does_not_hide_the_package(tmp_path):
    """As in the folder that holds the clone, which is called after its repository."""
    (tmp_path / "echousd" / "model").mkdir(parents=True)
    (tmp_path / "echomodel").mkdir()
    code = "import echousd, echomodel.vocabulary, echousd.schemas; print(echousd.generate.__name__, echousd.__file__)"
    variables = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split()[0] == "generate"
    assert str(tmp_path) not in done.stdout


@pytest.fixture
def script(monkeypatch):
    """What setup.py defines, and as `told_setup` what it tells setuptools."""
    told: dict = {}
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr("setuptools.setup", told.update)
    return {**runpy.run_path(str(ROOT / "setup.py")), "told_setup": told}


def test_an_editable_install_says_where_types_are(script):
    lines = script["told"]("import some_finder; some_finder.install()").decode().splitlines()
    assert lines[0].startswith("import some_finder; some_finder.install(); import sys; ")
    assert "some_finder" in lines[0].rpartition("!=")[2]
    for line, package in zip(lines[1:], ("echousd", "echomodel"), strict=True):
        assert (Path(line) / package / "py.typed").is_file()


@pytest.fixture
def wheel(script):
    """The package and file names that a wheel holds."""
    told = script["told_setup"]
    made = Distribution(told)
    made.parse_config_files()
    build = made.get_command_obj("build_py")
    build.ensure_finalized()
    return {f"{package}/{name}" for package, _, _, names in build.data_files for name in names}


@pytest.mark.parametrize("package", ["echousd", "echomodel", "echoscene"])
def test_types_are_told_in_every_package(wheel, package):
    assert f"{package}/py.typed" in wheel
    assert (ROOT / ("." if package == "echousd" else "model") / package / "py.typed").is_file()


def needed(name):
    """Names of the distributions that one needs on this system, itself included."""
    found, todo = set(), [name]
    while todo:
        name = canonicalize_name(todo.pop())
        if name not in found:
            found.add(name)
            wanted = map(Requirement, metadata.requires(name) or ())
            todo += [one.name for one in wanted if one.marker is None or one.marker.evaluate({"extra": ""})]
    return found


def test_what_ships_is_pinned_by_its_hash():
    pinned = dict(re.findall(r"^([\w.-]+)==(\S+)", (ROOT / "constraints.txt").read_text(), re.MULTILINE))
    pinned = {canonicalize_name(name): version for name, version in pinned.items()}
    rows = [line for line in (ROOT / "requirements.txt").read_text().splitlines() if not line.startswith("#")]
    hashed = dict(re.fullmatch(r"([a-z0-9.-]+)==(\S+) --hash=sha256:[0-9a-f]{64}", row).groups() for row in rows)
    assert needed("echousd") - {"echousd"} <= hashed.keys()
    assert {name: version for name, version in hashed.items() if pinned.get(name, version) != version} == {}
    text = (ROOT / "pyproject.toml").read_text()
    direct = {canonicalize_name(Requirement(one).name) for one in tomllib.loads(text)["project"]["dependencies"]}
    assert direct <= hashed.keys() & pinned.keys()


@pytest.mark.parametrize(
    ("found", "text", "code"),
    [
        ([{"name": "a", "version": "1", "vulns": []}], "audit: 1 of 1 audited, 0 known faults", 0),
        ([{"name": "a", "version": "1", "vulns": [{"id": "X-1"}]}], "a 1: X-1", 1),
        ([{"name": "a", "skip_reason": "?"}], "could not be asked about a", 2),
        ([], "0 of 0 audited", 2),
    ],
)
def test_an_audit_of_nothing_is_no_good_news(found, text, code):
    told, ended = runpy.run_path(str(ROOT / "docs/audited.py"))["said"](found)
    assert text in told
    assert ended == code
