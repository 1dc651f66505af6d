"""What stands in a room: where its geometry comes from, and what it is made of."""

FACES = 5000  # budget of each mesh, unless another is asked for
