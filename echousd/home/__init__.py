"""A home: a graph of rooms becomes a plan, every room is furnished in its place, and the whole is judged."""
