"""Folders of rooms in which a run was interrupted while it moved its files into place (no pxr here)."""

from __future__ import annotations

STAGING = ".echousd"  # folder in a room's where a run keeps what is not in place yet
JOURNAL = "journal.json"  # in it: what goes where
