"""Many rooms: one plan, workers that may die, a journal, and a manifest of what came out."""
