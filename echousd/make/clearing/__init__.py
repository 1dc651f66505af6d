"""Furniture moved apart by its solids: chairs are tucked as far as they fit, nothing starts inside anything."""

from echousd.make.clearing.clearing import Cleared, cleared, cleared_layouts

__all__ = ["Cleared", "cleared", "cleared_layouts"]
