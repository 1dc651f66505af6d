"""Scene graphs on USD stages: written in bulk, read through any composition, changed in place."""
