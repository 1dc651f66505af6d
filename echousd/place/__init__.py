"""After sampling, boxes are moved and sized as little as possible until the room keeps its graph without collisions."""
