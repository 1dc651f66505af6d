"""What stands in a room: where its geometry comes from, and what it is made of."""
