"""Rooms to learn from: floors, functional groups and lamps, drawn so that they look like real ones in numbers."""
