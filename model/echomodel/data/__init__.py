"""Rooms and furniture to learn from: generators, relations, sets on disk and the SG-FRONT loader."""
