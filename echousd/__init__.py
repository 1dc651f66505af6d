"""EchoUSD: author indoor scenes in USD from semantic scene graphs."""

import importlib
import re
from pathlib import Path
from typing import Any

from echousd import plugin

plugin.register()  # first act: a stage opened before the schema is registered never learns it

__version__ = "0.2.0"

# Public name -> its module, as `__init__.pyi` says, imported on first use: `import echousd` loads no pxr and no torch.
_STUB = Path(__file__).with_suffix(".pyi").read_text("utf-8")
_HOME = {name: module for module, name in re.findall(r"^from (\S+) import (\w+)", _STUB, re.MULTILINE)}
__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'echousd' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
