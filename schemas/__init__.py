"""The USD schema, and the codeless plugin generated from it (resources/)."""
