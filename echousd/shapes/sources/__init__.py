"""Where the geometry of objects comes from: what a model makes, what a library has, and a room of both."""
