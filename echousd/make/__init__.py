"""From a scene graph to a room, and edits of it."""
