"""Functions that tables name: the module of one is imported when it is called, not with the table."""

from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from typing import Any


@dataclass(frozen=True)
class Late:
    """The function, class or class method at `place`, `module:name`."""

    place: str

    def __call__(self, *given: Any, **by_name: Any) -> Any:
        module, name = self.place.split(":")
        return attrgetter(name)(import_module(module))(*given, **by_name)
