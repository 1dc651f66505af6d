"""Whether a room rests: its physics, simulated for a while (extra `sim`)."""
