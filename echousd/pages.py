"""Pages from templates (Jinja), which lie in a package's folder `templates`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import resources
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Template


def template(package: str, name: str, *, escaped: bool = True, **filters: Callable[..., Any]) -> Template:
    """A template of a package with filters besides Jinja's; `escaped`: what fills it is no HTML, unless it says so."""
    from jinja2 import Environment

    environment = Environment(autoescape=escaped)
    environment.filters.update(filters)
    return environment.from_string(resources.files(package).joinpath("templates", name).read_text("utf-8"))
