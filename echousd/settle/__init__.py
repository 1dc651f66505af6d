"""Whether a room rests: its physics, simulated for a while (extra `sim`)."""

from echousd.settle.settle import Motion, SettleReport, SettleUnavailable, require_engine, settle, settle_layouts

__all__ = ["Motion", "SettleReport", "SettleUnavailable", "require_engine", "settle", "settle_layouts"]
