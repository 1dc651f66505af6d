"""Small things that make a room look lived in, placed by rules on what the graph put there; the graph is untouched."""
