"""How the package is installed: no folder of its name hides it, and its types are told."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
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
