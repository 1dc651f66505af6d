"""Functions of compiled modules, without what the packages around these import besides."""

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from typing import Any

from echomodel.late import Late


@dataclass(frozen=True)
class Compiled(Late):
    """A function of a compiled module, without the third of a second of what its package imports besides."""

    @cached_property
    def itself(self) -> Any:
        """What stands there; where no such module is, what the package has under that name."""
        module, name = self.place.split(":")
        (top, *below), own = module.split(".")[:-1], module.rpartition(".")[2]
        whole = find_spec(top)
        folder = Path(whole.origin).parent.joinpath(*below) if whole and whole.origin else Path()
        spec = FileFinder(str(folder), (ExtensionFileLoader, EXTENSION_SUFFIXES)).find_spec(own)
        if spec is None or spec.loader is None:
            return getattr(import_module(".".join((top, *below))), name)
        found = module_from_spec(spec)
        spec.loader.exec_module(found)
        return getattr(found, name)


linear_sum_assignment = Compiled("scipy.optimize._lsap:linear_sum_assignment")
