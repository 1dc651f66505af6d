"""What is imported when it is called: functions that tables name, modules of optional extras."""

from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
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


def extra(module: str, need: str, name: str, error: type[Exception] = ValueError) -> Any:
    """A module of an optional extra of that name; raises an error that says the need and how to install it."""
    try:
        return import_module(module)
    except ImportError:
        raise error(f"{need}: pip install 'echousd[{name}]'") from None
