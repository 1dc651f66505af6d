"""The report of a suite: Markdown, JSON and one HTML file without links, equal for equal runs."""

from __future__ import annotations

import base64
import io
import json
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from echomodel.data.sheet import plot_rooms
from echomodel.files import write_json, write_text
from echomodel.metrics.statistics import Figure
from echomodel.roomboxes import RoomBoxes
from echousd.evaluation.runs import Run, Table

FORMS = (".md", ".json", ".html")
SHOWN = 6  # rooms of each system in the contact sheet
PANELS, ACROSS = 16, 6  # columns beyond which a table has no plot; panels in a line


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
    told = [table for tables in content["sections"].values() for table in tables]
    for table, made in zip(told, found["tables"], strict=True):
        table["plot"] = plot(made)
    write_text(paths[2], _rendered("report.html.j2", content | {"pictures": pictures(run)}, escaped=True))
    seconds = out.with_name(f"{out.name}.seconds.json")
    write_json(seconds, {"CPU seconds a room": {name: round(value, 3) for name, value in run.seconds.items()}})
    return [*paths, seconds]


def _content(found: Mapping[str, Any], command: str) -> dict[str, Any]:
    published = json.loads(resources.files("echousd.evaluation").joinpath("published.json").read_text("utf-8"))
    theirs = {table["title"]: table for table in published["tables"]}
    sections: dict[str, list[dict[str, Any]]] = {}
    for table in found["tables"]:
        columns = list(dict.fromkeys(column for row in table.rows.values() for column in row))
        other = theirs.get(table.title) or {"columns": [], "rows": {}, "where": ""}
        if not {*other["columns"]} <= {*columns}:
            other = {"columns": [], "rows": {}, "where": ""}  # not measured here: it stands below
        theirs.pop(table.title if other["rows"] else "", None)
        sections.setdefault(table.name, []).append(
            {
                "title": table.title, "note": table.note, "columns": columns, "where": other["where"],
                "rows": [{"name": n, "cells": [cell(row.get(c)) for c in columns]} for n, row in table.rows.items()],
                "published": _published(other, columns),
            }
        )  # fmt: skip
    rest = [table | {"cells": _published(table, table["columns"])} for table in theirs.values()]
    return {
        **found,
        "about": {**found["about"], "command": command},
        "sections": sections,
        "reference": next(iter(found["tables"][0].rows)) if found["tables"] else "",
        "published": published | {"tables": rest},
    }


def _published(table: Mapping[str, Any], columns: Sequence[str]) -> list[dict[str, Any]]:
    told = {name: dict(zip(table["columns"], row, strict=True)) for name, row in table["rows"].items()}
    return [
        {"name": name, "cells": ["-" if row.get(c) is None else f"{row[c]:g}" for c in columns]}
        for name, row in told.items()
    ]


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
    from markupsafe import Markup, escape

    environment = Environment(autoescape=escaped)
    environment.filters["code"] = lambda text: Markup(re.sub("`(.*?)`", r"<code>\1</code>", str(escape(text))))
    text = resources.files("echousd.evaluation").joinpath("templates", name).read_text("utf-8")
    return environment.from_string(text).render(**content) + "\n"


def plot(table: Table) -> str:
    """A table as SVG, a panel for each column or curve; "" where there is nothing to see.

    Bars have their intervals, every panel a scale of its own.
    """
    told = [c for row in table.rows.values() for c, found in row.items() if found.value is not None]
    columns = list(dict.fromkeys(told))
    if table.plain or not (table.curves or 0 < len(columns) <= PANELS):
        return ""
    if table.curves:
        with _panels(list(table.curves), 2.6) as (every, out):
            for axes, lines in zip(every, table.curves.values(), strict=True):
                for number, (name, (x, y)) in enumerate(lines.items()):
                    axes.plot(x, y, ["-", "--", ":"][number % 3], label=name, lw=1.2, color=f"C{number % 10}")
            every[0].legend(fontsize=6, frameon=False)
        return out[0]
    names = list(table.rows)
    with _panels(columns, 0.5 + 0.14 * len(names)) as (every, out):
        for number, (axes, column) in enumerate(zip(every, columns, strict=True)):
            found = [table.rows[name].get(column) or Figure(None) for name in names]
            value = np.array([f.value if f.value is not None else np.nan for f in found], float)
            ends = np.array([[f.low, f.high] if f.low is not None else [np.nan] * 2 for f in found], float)
            reach = np.nan_to_num(np.abs(ends - value[:, None])).T
            tint = ["#356" if name == names[0] else "#9ab" for name in names]
            axes.barh(range(len(names)), value, xerr=reach, error_kw={"lw": 0.7}, color=tint)
            axes.set_yticks(range(len(names)), names if number % ACROSS == 0 else [""] * len(names))
            axes.invert_yaxis()
    return out[0]


@contextmanager
def _panels(titles: Sequence[str], height: float) -> Iterator[tuple[list[Any], list[str]]]:
    """Axes with these titles, and a list that holds the SVG of them afterwards."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Canvas

    lines, out = -(-len(titles) // ACROSS), list[str]()
    with rc_context({"svg.hashsalt": "echousd", "svg.fonttype": "none", "font.size": 7}):
        across = min(len(titles), ACROSS)
        canvas = Canvas(figsize=(1.4 + 1.9 * across, lines * (height + 0.3)), layout="constrained")
        every = list(np.ravel(canvas.subplots(lines, across)))
        for axes, title in zip(every, titles, strict=False):
            axes.set_title(title, fontsize=7.5)
            axes.spines[["top", "right"]].set_visible(False)
        for axes in every[len(titles) :]:
            axes.remove()
        yield every[: len(titles)], out
        text = io.StringIO()
        canvas.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    out.append(re.sub(r"<metadata>.*?</metadata>", "", text.getvalue(), flags=re.DOTALL).partition('.dtd">')[2].strip())


def pictures(run: Run) -> dict[str, str]:
    """Contact sheets, PNG as base64: the same rooms by every system, a row each, as plans and from above."""
    names = list(run.made)
    rows: list = []
    for number in np.linspace(0, len(run.tasks) - 1, min(SHOWN, len(run.tasks))).astype(int):
        rows += [replace(made[number], id=name) for name, made in run.made.items() if number < len(made)]
    out = {"The same rooms by every system": sheet(rows, len(names))} if rows else {}
    if run.shown:
        whole = np.concatenate([np.concatenate(list(shown), 1) for shown in run.shown.values()])
        text = io.BytesIO()
        Image.fromarray(whole).save(text, "PNG")
        title = f"From above, top to bottom: {', '.join(run.shown)}"
        out[title] = base64.b64encode(text.getvalue()).decode()
    return out


def sheet(rooms: Sequence[RoomBoxes], columns: int) -> str:
    """Plans of rooms beside one another, PNG as base64."""
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        path = Path(folder) / "sheet.png"
        plot_rooms(rooms, path, columns=columns, labels=False)
        return base64.b64encode(path.read_bytes()).decode()
