"""Kinds of libraries; a new one is a module with a `CATALOGUE` and one line here."""

from __future__ import annotations

import importlib
from pathlib import Path

from echousd.assets.catalogues.entry import Catalogue

# The first that a path is one of counts; a plain folder is everything else.
MODULES = ("sweethome", "abo", "objaverse", "hssd", "future3d", "folder")


def catalogue_of(path: Path) -> Catalogue:
    """The catalogue of a path; raises ValueError for a path that is none."""
    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    for name in MODULES:
        catalogue: Catalogue = importlib.import_module(f"{__name__}.{name}").CATALOGUE
        if catalogue.holds(path):
            return catalogue
    raise ValueError(f"{path}: neither a folder nor a model nor a library")
