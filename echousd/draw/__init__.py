"""Stages drawn: meshes to draw, where to look from, renderings and pictures."""
