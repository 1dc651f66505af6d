"""The model that makes a room: the one that is given, or the one in a weights file."""

from __future__ import annotations

from pathlib import Path

from echomodel.protocols import RoomModel

PRESETS = ("compact", "paper", "released")


def load_model(model: RoomModel | str | Path | None, preset: str | None = None) -> RoomModel:
    """The model itself, or the one in a weights file (None: shipped), of the kind that the file says it is.

    Raises ValueError where there is none, or one of another preset than `preset`.
    """
    check_preset(model, preset)
    from echomodel.checkpoint import is_released

    if model is not None and not isinstance(model, str | Path):
        found: RoomModel = model
    elif model is not None and is_released(model):
        from echomodel.released.echo import ReleasedEcho

        found = ReleasedEcho.load(model)
    else:
        from echomodel.echo import EchoModel

        found = EchoModel.load(model)
    if preset not in (None, found.preset):
        raise ValueError(f"{model}: holds a model of the preset {found.preset!r}, asked for: {preset!r}")
    return found


def check_preset(model: RoomModel | str | Path | None, preset: str | None) -> None:
    """Raises ValueError for an unknown preset, or one without weights of its own where none are given."""
    if preset not in (None, *PRESETS):
        raise ValueError(f"preset is {preset!r}, allowed: {', '.join(PRESETS)}")
    if model is None and preset not in (None, "compact"):
        how = "train it" if preset == "paper" else "convert a published checkpoint (echousd convert)"
        raise ValueError(f"no weights ship for the preset {preset!r}: {how} and name the file (--weights FILE)")
