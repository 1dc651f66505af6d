"""Pieces of one's own: files that a graph names."""

from echousd.shapes.sources.library import LibraryAssets

SOURCE = LibraryAssets("own", "files that the graph names")
