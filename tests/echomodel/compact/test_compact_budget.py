"""The compact preset stays within its budget, counted by torch's flop counter."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "benchmarks" / "compact_budget.py"


def test_compact_preset_stays_within_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    for place in ("guidance", "compact.sampling"):  # no products of matrices, which are what is counted
        monkeypatch.setattr(f"echomodel.{place}.mended", lambda plan, boxes, **_: boxes)
    spec = importlib.util.spec_from_file_location("compact_budget", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = module.budget()
    assert found.keys() == module.LIMITS.keys()
    for name, value in found.items():
        assert 0 < value <= module.LIMITS[name], name
