"""Which formats of floor plans are read, how each is known, and by whom it is read."""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from shapely.errors import ShapelyError

from echomodel.bounded import read_bounded
from echomodel.files import within_memory
from echousd.graph import GraphError
from echousd.graph.consistency import faults_of
from echousd.home.importing.drawings import read_dxf, read_ifc, read_svg
from echousd.home.importing.found import Drawn
from echousd.home.importing.homes import Imported, imported
from echousd.home.importing.simulators import (
    read_infinigen,
    read_procthor,
    read_roomplan,
    read_sage,
    read_scenesmith,
    read_sweethome,
)

MOST = 256 * 2**20  # bytes of a file
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}


@dataclass(frozen=True)
class Format:
    """A format: what it is called, how a file in it ends, whether it needs a unit to be told, and its reader.

    Arguments:
        recognised: of JSON, whether this is the format of some data; None for others.
        read: of a path and a unit in metres (`None` = as the file says), or of the data.
    """

    name: str
    ending: str
    read: Callable[..., Drawn]
    recognised: Callable[[Any], bool] | None = None
    metric: bool = True  # always in one unit, so that none can be told


def _first(data: Any, key: str) -> Any:
    """The first entry under a key, {} where there is none."""
    found = data.get(key)
    entries = list(found.values()) if isinstance(found, dict) else found
    return entries[0] if isinstance(entries, list) and entries and isinstance(entries[0], dict) else {}


FORMATS = (
    Format("dxf", ".dxf", read_dxf, metric=False),
    Format("ifc", ".ifc", read_ifc, metric=False),
    Format("svg", ".svg", lambda path, unit: read_svg(read_bounded(path, MOST), unit), metric=False),
    Format("sweethome", ".sh3d", lambda path, unit: read_sweethome(read_bounded(path, MOST), path.name)),
    Format("scenesmith", ".json", read_scenesmith, lambda data: "placed_rooms" in data),
    Format("procthor", ".json", read_procthor, lambda data: "floorPolygon" in _first(data, "rooms")),
    Format(
        "roomplan", ".json", read_roomplan, lambda data: "transform" in _first(_first(data, "rooms") or data, "walls")
    ),
    Format("sage", ".json", read_sage, lambda data: {"room_type", "walls"} <= _first(data, "rooms").keys()),
    Format("infinigen", ".json", read_infinigen, lambda data: bool({"shape", "operation"} & {*_first(data, "rooms")})),
)


def unit_of(text: str | None) -> float | None:
    """Metres of a unit by its name or as a number; raises `GraphError`."""
    if text is None or text in UNITS:
        return None if text is None else UNITS[text]
    try:
        metres = float(text)
    except ValueError:
        metres = 0.0
    if not 1e-6 <= metres <= 1e4:
        raise GraphError(f"--unit {text!r}, allowed: {', '.join(UNITS)} or metres of one unit")
    return metres


def import_plan(
    path: str | Path, *, format: str | None = None, unit: str | None = None, storey: str | None = None,
    lenient: bool = False,
) -> Imported:  # fmt: skip
    """The home in somebody's floor plan: DXF, SVG, IFC, Sweet Home 3D, or JSON of RoomPlan and simulators.

    Arguments:
        format: its format, where that is not to be found out.
        unit: m, cm, mm, in, ft or metres of one unit, where the file does not say.
        storey: one of several, None = the lowest. lenient: leave out doors and windows that meet no wall.

    Raises `GraphError` that names the file.
    """
    name, found = read_plan(Path(path), format, unit_of(unit))
    with faults_of(str(path)):
        return imported(replace(found, format=name), storey, lenient=lenient)


def read_plan(path: Path, form: str | None = None, unit: float | None = None) -> tuple[str, Drawn]:
    """The name of the format of somebody's floor plan, and what is in it.

    Arguments:
        form: its format, where that is not to be found out. unit: metres of a unit, where the file does not say.

    Raises `GraphError` that names the file.
    """
    try:
        chosen, data = _format_of(path, form)
        if unit is not None and chosen.metric:
            raise GraphError(f"--unit: {chosen.name} is always in one unit, allowed: to leave it out")
        with within_memory(path):
            return chosen.name, chosen.read(data) if chosen.recognised else chosen.read(path, unit)
    except GraphError as error:
        message = str(error).removeprefix(f"{path.name}: ")
        raise GraphError(message if message.startswith(str(path)) else f"{path}: {message}") from None
    except OSError as error:
        raise GraphError(f"{path}: {(error.strerror or str(error)).lower()}") from None
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError, ShapelyError) as error:
        message = str(error)
        if isinstance(error, ValidationError):
            message = "a {title} of {input!r:.60}: {msg}".format(title=error.title.lower(), **error.errors()[0])
            message = " ".join(message.replace("Value error, ", "").split())
        message = message.removeprefix(f"{path}: ").removeprefix(f"{path.name}: ").partition("\n")[0]
        reason = f"{error} is missing" if isinstance(error, KeyError) else message
        raise GraphError(f"{path}: not as {form or path.suffix.lstrip('.')} has it ({reason})") from None


def _format_of(path: Path, form: str | None) -> tuple[Format, Any]:
    """The format of a file, and of JSON its data."""
    names = ", ".join(dict.fromkeys(one.name for one in FORMATS))
    if form is not None and form not in [one.name for one in FORMATS]:
        raise GraphError(f"--format {form!r}, allowed: {names}")
    fitting = [one for one in FORMATS if one.name == form or (form is None and one.ending == path.suffix.lower())]
    if not fitting:
        raise GraphError(f"extension {path.suffix!r}, allowed: {', '.join(dict.fromkeys(f.ending for f in FORMATS))}")
    if fitting[0].recognised is None:
        if path.stat().st_size > MOST:
            raise GraphError(f"{path.stat().st_size} bytes, allowed: at most {MOST}")
        return fitting[0], None
    data = json.loads(read_bounded(path, MOST))
    if not isinstance(data, dict):
        raise GraphError("no plan that is known, allowed: an object with rooms")
    known = [one for one in fitting if form or (one.recognised is not None and one.recognised(data))]
    if not known:
        names = ", ".join(one.name for one in FORMATS if one.recognised)
        raise GraphError(f"no plan that is known, allowed: JSON of {names}")
    return known[0], data
