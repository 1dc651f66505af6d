"""Furniture that somebody else made: brought into the object frame, referenced or converted, never changed."""
