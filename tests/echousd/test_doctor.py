"""`echousd plugin-path` and `echousd doctor`."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from importlib import util
from pathlib import Path

import pytest

from echousd import diagnosis, plugin


def test_plugin_path(echousd_command):
    done = echousd_command("plugin-path")
    assert (done.code, done.out) == (0, f"{plugin.plugin_path()}\n")


def test_plugin_path_and_help_never_load_pxr(loaded_by):
    loaded = loaded_by(
        "from echousd.cli.main import run\n"
        "for words in (['plugin-path'], ['--help'], ['doctor', '--help']): assert run(words) == 0"
    )
    assert not {"pxr", "torch", "numpy"} & loaded


def test_doctor_as_json(echousd_command):
    done = echousd_command("doctor", "--json")
    report = json.loads(done.out)
    found = {finding["name"]: finding for finding in report["findings"]}
    assert found["usd"]["state"] == "ok"
    assert "usd-core" in found["usd"]["found"]
    assert found["schema plugin"] == {
        "name": "schema plugin",
        "state": "ok",
        "found": f"active, {plugin.plugin_path()}",
        "remedy": "",
    }
    assert "cpu" in found["torch"]["found"]
    assert {f"extra {extra}" for extra in diagnosis.EXTRAS} <= set(found)
    assert all(finding["remedy"] for finding in report["findings"] if finding["state"] != "ok")
    assert report["ok"] == all(finding["state"] != "gap" for finding in report["findings"])
    assert done.code == (0 if report["ok"] else 1)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere torch is asked for its devices")
def test_doctor_asks_torch_only_where_there_may_be_a_gpu():
    code = (
        "import sys\nfrom echousd import diagnosis\ndiagnosis.GPUS = ({!r},)\n"
        "found = {{one.name: one for one in diagnosis.diagnose()}}\n"
        "assert 'cpu' in found['torch'].found, found\nprint('torch' in sys.modules)"
    )
    for device, imported in (("/dev/no_such_device", "False"), ("/dev/null", "True")):
        done = subprocess.run([sys.executable, "-c", code.format(device)], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout) == (0, f"{imported}\n"), done.stderr


def test_every_extra_of_the_distribution_is_looked_at():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))["project"]
    assert diagnosis.EXTRAS.keys() == project["optional-dependencies"].keys() - {"dev"}


def test_doctor_as_a_table(echousd_command):
    done = echousd_command("doctor")
    assert done.code in (0, 1)
    assert str(plugin.plugin_path()) in done.out
    assert "remedy" in done.out


@pytest.fixture
def without(monkeypatch):
    """Make modules look as if they were not installed."""

    def hide(*names):
        real = util.find_spec
        monkeypatch.setattr(util, "find_spec", lambda name, *rest: None if name in names else real(name, *rest))

    return hide


def test_missing_extras_are_no_gap(without, echousd_command):
    without("xatlas")
    found = {finding.name: finding for finding in diagnosis.diagnose()}
    assert found["extra texture"].state == "optional"
    assert found["extra texture"].remedy == "pip install 'echousd[texture]'"


def test_missing_usd_and_torch_are(without, echousd_command):
    without("pxr", "torch")
    found = {finding.name: finding for finding in diagnosis.diagnose()}
    assert (found["usd"].state, found["usd"].remedy) == ("gap", "pip install usd-core")
    assert (found["torch"].state, found["torch"].remedy) == ("gap", "pip install torch")
    assert found["schema plugin"].state == "gap"
    assert echousd_command("doctor").code == 1


def test_an_inactive_plugin_is_a_gap(monkeypatch):
    monkeypatch.setattr(plugin, "is_active", lambda: False)
    found = {finding.name: finding for finding in diagnosis.diagnose()}
    assert found["schema plugin"].state == "gap"
    assert f"PXR_PLUGINPATH_NAME={plugin.plugin_path()}" in found["schema plugin"].remedy


def test_an_old_usd_is_a_gap(monkeypatch):
    from pxr import Usd

    monkeypatch.setattr(Usd, "GetVersion", lambda: (0, 24, 8))
    found = {finding.name: finding for finding in diagnosis.diagnose()}
    assert found["usd"].state == "gap"
    assert found["usd"].remedy.startswith("OpenUSD 24.11 or newer is needed")


def test_warnings_are_one_line(tmp_path):
    (tmp_path / "foreign.usda").write_text("""#usda 1.0
def Cube "bed" (prepend apiSchemas = ["SemanticsLabelsAPI:class"]) {
    token[] semantics:labels:class = ["bed"]
    double size = 200
}
def Cube "harp" (prepend apiSchemas = ["SemanticsLabelsAPI:class"]) {
    token[] semantics:labels:class = ["harp"]
}
""")
    command = [sys.executable, "-c", "from echousd.cli.main import main; main()", "graph", "foreign.usda", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0
    assert json.loads(done.stdout)["nodes"][0]["category"] == "double_bed"
    assert done.stderr.startswith("warning: ")
    assert done.stderr.endswith("foreign.usda: labelled prims that became no node: unknown label 'harp' (1)\n")
    assert done.stderr.count("\n") == 1
