"""Finishes: tileable pictures of wood, cloth, plaster and more by programs of ours, coloured by a room's harmony."""
