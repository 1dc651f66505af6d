"""Rooms to learn from: floors, functional groups and lamps, drawn so that they look like real ones in numbers."""

from echomodel.rooms.generator import generate_room, generate_rooms, untidied

__all__ = ["generate_room", "generate_rooms", "untidied"]
