"""A room's folder on disk: manifest, journal, history, ownership, lock."""
