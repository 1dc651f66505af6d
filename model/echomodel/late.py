"""What is imported when it is called: functions that tables name, modules of optional extras."""

from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder
from importlib.util import find_spec, module_from_spec
from operator import attrgetter
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Late:
    """The function, class or class method at `place`, `module:name`."""

    place: str

    @property
    def itself(self) -> Any:
        """What stands there."""
        module, name = self.place.split(":")
        return attrgetter(name)(import_module(module))

    @property
    def __name__(self) -> str:
        return self.place.partition(":")[2]

    def __call__(self, *arguments: Any, **by_name: Any) -> Any:
        return self.itself(*arguments, **by_name)


def lates(module: str, *names: str) -> list[Late]:
    """Several of one module."""
    return [Late(f"{module}:{name}") for name in names]


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


def extra(module: str, need: str, name: str, error: type[Exception] = ValueError) -> Any:
    """A module of an optional extra of that name; raises an error that says the need and how to install it."""
    try:
        return import_module(module)
    except ImportError:
        raise error(f"{need}: pip install 'echousd[{name}]'") from None
