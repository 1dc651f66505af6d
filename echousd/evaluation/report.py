"""The report of a suite: Markdown, JSON and one HTML file without links, equal for equal runs."""

from __future__ import annotations

import base64
import io
import json
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from echomodel.data.sheet import plot_rooms
from echomodel.files import write_json, write_text
from echomodel.metrics.statistics import Figure
from echomodel.roomboxes import RoomBoxes
from echousd.evaluation.runs import Run, Table

FORMS = (".md", ".json", ".html")
SHOWN = 6  # rooms of each system in the contact sheet
BARS = 14  # columns beyond which a table has no plot


def write_report(found: Mapping[str, Any], run: Run, out: Path, command: str) -> list[Path]:
    """Write `out` with each of `FORMS`, and beside them the seconds, which differ from run to run.

    Arguments:
        found: as `evaluate` gives it. command: that made it. out: any ending of `FORMS` is left away.
    """
    out = out.with_suffix("") if out.suffix in FORMS else out
    out.parent.mkdir(parents=True, exist_ok=True)
    content = _content(found, command)
    paths = [out.with_name(out.name + form) for form in FORMS]
    write_text(paths[0], _rendered("report.md.j2", content, escaped=False))
    plain = {**found, "about": content["about"], "tables": [asdict(table) for table in found["tables"]]}
    write_text(paths[1], json.dumps(plain, indent=1, default=float) + "\n")
    plots = {id(table): bars(table) for table in found["tables"]}
    for tables in content["sections"].values():
        for table in tables:
            table["plot"] = plots[table["id"]]
    write_text(paths[2], _rendered("report.html.j2", content | {"pictures": pictures(run)}, escaped=True))
    seconds = out.with_name(f"{out.name}.seconds.json")
    write_json(seconds, {"CPU seconds a room": {name: round(value, 3) for name, value in run.seconds.items()}})
    return [*paths, seconds]


def _content(found: Mapping[str, Any], command: str) -> dict[str, Any]:
    sections: dict[str, list[dict[str, Any]]] = {}
    for table in found["tables"]:
        columns = list(dict.fromkeys(column for row in table.rows.values() for column in row))
        rows = [
            {"name": name, "cells": [cell(row.get(column)) for column in columns]} for name, row in table.rows.items()
        ]
        sections.setdefault(table.name, []).append(
            {"id": id(table), "title": table.title, "note": table.note, "columns": columns, "rows": rows}
        )
    published = json.loads(resources.files("echousd.evaluation").joinpath("published.json").read_text("utf-8"))
    return {
        **found,
        "about": {**found["about"], "command": command},
        "sections": sections,
        "reference": next(iter(found["tables"][0].rows)) if found["tables"] else "",
        "published": published,
        "missing": found.get("missing", ()),
    }


def cell(found: Figure | None) -> str:
    """A figure as a table shows it."""
    if found is None or found.value is None:
        return "-"
    digits = 1 if abs(found.value) >= 100 else 2 if abs(found.value) >= 10 else 3
    text = f"{found.value:.{digits}f}"
    if found.low is not None and found.high is not None:
        text += f" [{found.low:.{digits}f}, {found.high:.{digits}f}]"
    if found.p is not None and found.detects is not None:
        text += "*" * (found.p < 0.05) + f" ±{found.detects:.{digits}f}"
    return text


def _rendered(name: str, content: Mapping[str, Any], *, escaped: bool) -> str:
    from jinja2 import Environment

    text = resources.files("echousd.evaluation").joinpath("templates", name).read_text("utf-8")
    return Environment(autoescape=escaped).from_string(text).render(**content) + "\n"


def bars(table: Table) -> str:
    """A table as bars with their intervals, SVG; "" for one with too many columns."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Canvas

    columns = list(dict.fromkeys(column for row in table.rows.values() for column in row))
    if not 0 < len(columns) <= BARS:
        return ""
    with rc_context({"svg.hashsalt": "echousd", "svg.fonttype": "none", "font.size": 8}):
        canvas = Canvas(figsize=(11, 3.2), layout="constrained")
        axes, wide = canvas.subplots(), 0.86 / len(table.rows)
        for number, (name, row) in enumerate(table.rows.items()):
            found = [row.get(column) or Figure(None) for column in columns]
            value = np.array([f.value if f.value is not None else np.nan for f in found], float)
            low, high = (np.array([getattr(f, end) or 0.0 for f in found]) for end in ("low", "high"))
            at = np.arange(len(columns)) + (number - len(table.rows) / 2 + 0.5) * wide
            ends = np.nan_to_num(np.abs(np.stack([value - low, high - value])))
            axes.bar(at, value, wide, label=name, yerr=ends, error_kw={"lw": 0.6}, color=f"C{number % 10}")
        axes.set_xticks(range(len(columns)), columns, rotation=20, ha="right")
        axes.legend(ncols=2, fontsize=6, loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes.spines[["top", "right"]].set_visible(False)
        out = io.StringIO()
        canvas.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"<metadata>.*?</metadata>", "", out.getvalue(), flags=re.DOTALL).partition('.dtd">')[2].strip()


def pictures(run: Run) -> dict[str, str]:
    """Contact sheets, PNG as base64: the same rooms by every system, a row each."""
    names = list(run.made)
    rows: list = []
    for number in np.linspace(0, len(run.tasks) - 1, min(SHOWN, len(run.tasks))).astype(int):
        rows += [replace(run.made[name][number], id=f"{name} {number}") for name in names]
    return {"The same rooms by every system": sheet(rows, len(names))} if rows else {}


def sheet(rooms: Sequence[RoomBoxes], columns: int) -> str:
    """Plans of rooms beside one another, PNG as base64."""
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        path = Path(folder) / "sheet.png"
        plot_rooms(rooms, path, columns=columns, labels=False)
        return base64.b64encode(path.read_bytes()).decode()
