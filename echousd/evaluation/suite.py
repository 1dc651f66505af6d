"""The suite: every system is asked the same rooms; its report, equal for equal runs; a study with people."""

import base64
import hashlib
import io
import itertools
import json
import platform
import re
import tempfile
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.stats import binomtest

from echomodel.data.sheet import plot_rooms
from echomodel.files import write_json, write_text
from echomodel.loading import load_model
from echomodel.metrics.layouts import tasks_of
from echomodel.metrics.pictures import SIDE, WEIGHTS, features
from echomodel.metrics.statistics import LEVEL, Figure
from echomodel.progress import StageListener
from echomodel.roomboxes import RoomBoxes
from echousd.evaluation.runs import HONEST, SECTIONS, Run, SuiteSettings, Table, rooms_against, rooms_of, run_systems
from echousd.evaluation.sections import RUNNERS
from echousd.evaluation.systems import System, described
from echousd.pages import template
from echousd.textures import encoded

OWN = {"relations", "shapes"}  # sections that ask by tasks of their own
LIBRARIES = ("numpy", "scipy", "torch", "scikit-learn", "echousd")


def evaluate(settings: SuiteSettings, progress: StageListener | None = None) -> tuple[dict[str, Any], Run]:
    """Lay out and score: what the report says, and the rooms.

    Raises ValueError for systems, sets and sections that there are not.
    """
    for kind in WEIGHTS:
        if path := getattr(settings, kind):  # hours before they are wanted
            features(np.zeros((1, SIDE, SIDE, 3), np.uint8), kind, path)
    systems = [System.parse(name) for name in dict.fromkeys([*settings.systems, *HONEST])]
    systems = list({system.name: system for system in systems}.values())
    theirs = {system.name: rooms_of(system, settings) for system in systems if system.foreign}
    rooms, others = rooms_against(settings)
    tasks = tasks_of(rooms, settings.seed, stated=settings.relations)
    chosen = [name for name in SECTIONS if name in (settings.only or SECTIONS)]
    able = [s for s in systems if not s.foreign and {*chosen} - OWN]
    asked, seconds = run_systems(able, tasks, settings, progress)
    made = {s.name: asked.get(s.name) or [t.room for t in theirs[s.name][0]] for s in systems if s.foreign or asked}
    of = {s.name: theirs[s.name][0] if s.foreign else tasks for s in systems}
    run = Run(
        settings, systems, tasks, others, made, of, seconds, [note for _, notes in theirs.values() for note in notes]
    )
    tables = []
    for number, name in enumerate(chosen):
        tables += RUNNERS[name](run)
        if progress:
            progress("figures", number + 1, len(chosen))
    found = {
        "settings": {name: value for name, value in asdict(settings).items() if name != "workers"},
        "about": about(systems, rooms, others),
        "systems": {system.name: described(system) for system in systems},
        "tables": tables,
        "missing": run.missing,
    }
    return found, run


def about(systems: Sequence[System], rooms: Sequence[RoomBoxes], others: Sequence[RoomBoxes]) -> dict[str, Any]:
    """Versions, and hashes of data and weights."""
    text = json.dumps([room.to_json() for room in [*rooms, *others]], sort_keys=True)
    weights = {"shipped": load_model(None).hash} | {s.name: load_model(s.weights).hash for s in systems if s.weights}
    return {
        "versions": {"python": platform.python_version()} | {name: version(name) for name in LIBRARIES},
        "data": hashlib.sha256(text.encode()).hexdigest(),
        "weights": weights,
        "rooms": len(rooms),
        "objects": sum(map(len, rooms)),
    }


REPEATED = 8  # every so manieth pair comes again
QUESTION = "In which room would you rather live?"


def write_study(
    names: Sequence[str], against: str, count: int, seed: int, out: Path, progress: StageListener | None = None
) -> Path:
    """Write the page. Raises ValueError for fewer than two systems, and as the suite."""
    systems = [system for name in names if not (system := System.parse(name)).foreign]
    if len(systems) < 2:
        raise ValueError(f"{len(systems)} systems that can be asked the same rooms, allowed: 2 or more")
    settings = SuiteSettings(tuple(names), against, count, seed)
    tasks = tasks_of(rooms_against(settings)[0], seed, stated=settings.relations)
    made, _ = run_systems(systems, tasks, settings, progress)
    pictures = {
        f"{name}/{number}": sheet([replace(room, id="")], 1) for name, rooms in made.items()
        for number, room in enumerate(rooms)
    }  # fmt: skip
    pairs = [
        {"room": number, "one": one, "other": other}
        for number in range(len(tasks))
        for one, other in itertools.combinations(made, 2)
    ]
    content = {"pairs": pairs, "pictures": pictures, "repeated": REPEATED, "seed": seed}
    write_text(out, rendered("study.html.j2", {"question": QUESTION, "content": content}))
    return out


def preferences(files: Sequence[Path]) -> dict[str, Any]:
    """What people answered.

    Returns:
        `pairs`: of two systems how often the one was `preferred` of `asked` decided answers, its share with Wilson's
        interval, `ties`, and `p` of an exact test that both are liked alike; `people`, `kept` who answered repeated
        pairs alike, and the share of `repeats` that were.

    Raises ValueError for a file that no page saved.
    """
    votes: dict[tuple[str, str], list[int]] = defaultdict(lambda: [0, 0, 0])
    kept = alike = repeats = 0
    for file in files:
        try:
            answers = json.loads(file.read_text("utf-8"))["answers"]
            again = [(a["choice"], a["first"]) for a in answers if a.get("first") is not None]
            rows = [(a["one"], a["other"], a["choice"]) for a in answers if a.get("first") is None]
        except (AttributeError, KeyError, TypeError, json.JSONDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{file}: no answers of a study ({type(error).__name__} {error})") from None
        same = sum(choice == first for choice, first in again)
        alike, repeats = alike + same, repeats + len(again)
        if again and same * 2 < len(again):
            continue
        kept += 1
        for one, other, choice in rows:
            turned = one > other
            row = votes[(other, one) if turned else (one, other)]
            row[2 if choice not in (one, other) else int((choice == other) != turned)] += 1
    pairs = []
    for (one, other), (first, second, ties) in sorted(votes.items()):
        asked = first + second
        test = binomtest(first, asked) if asked else None
        wilson = test.proportion_ci(LEVEL, "wilson") if test else None
        pairs.append(
            {"one": one, "other": other, "preferred": first, "asked": asked, "ties": ties,
             "share": first / asked if asked else 0.5, "low": wilson.low if wilson else 0.0,
             "high": wilson.high if wilson else 1.0, "p": test.pvalue if test else 1.0}
        )  # fmt: skip
    return {"pairs": pairs, "people": len(files), "kept": kept, "repeats": f"{alike} of {repeats}"}


FORMS = (".md", ".json", ".html")
SHOWN = 6  # rooms of each system in the contact sheet
PANELS, ACROSS = 16, 6  # columns beyond which a table has no plot; panels in a line


def report_files(out: Path) -> list[Path]:
    """The files of a report, with each of `FORMS`, of which `out` may be one, and the seconds."""
    out = out.with_suffix("") if out.suffix in FORMS else out
    return [out.with_name(out.name + form) for form in (*FORMS, ".seconds.json")]


def write_report(found: Mapping[str, Any], run: Run, out: Path, command: str) -> list[Path]:
    """Write `report_files`: with each of `FORMS`, and beside them the seconds, which differ from run to run.

    Arguments:
        found: as `evaluate` gives it. command: that made it.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    content = {**found, "about": {**found["about"], "command": command}}
    page = {**content, **_arranged(found["tables"]), "pictures": pictures(run)}
    md, plain, html, seconds = written = report_files(out)
    write_text(md, rendered("report.md.j2", page, escaped=False))
    form = content | {"tables": [asdict(table) for table in found["tables"]]}
    write_text(plain, json.dumps(form, indent=1, default=float) + "\n")
    write_text(html, rendered("report.html.j2", page))
    write_json(seconds, {"CPU seconds a room": {name: round(value, 3) for name, value in run.seconds.items()}})
    return written


def _arranged(tables: Sequence[Table]) -> dict[str, Any]:
    """The tables by sections, and which published ones stand `beside` ours: those whose columns are all measured."""
    published = json.loads(resources.files("echousd.evaluation").joinpath("published.json").read_text("utf-8"))
    for table in published["tables"]:
        table["rows"] = {n: dict(zip(table["columns"], row, strict=True)) for n, row in table["rows"].items()}
    measured = {table.title: {*table.columns} for table in tables}
    sections: dict[str, list[Table]] = {}
    for ours in tables:
        sections.setdefault(ours.name, []).append(ours)
    return {
        "sections": sections,
        "reference": next(iter(tables[0].rows)) if tables else "",
        "published": published,
        "beside": {t["title"]: t for t in published["tables"] if {*t["columns"]} <= measured.get(t["title"], set())},
    }


def cell(found: Figure | float | None) -> str:
    """A figure as a table shows it."""
    if not isinstance(found, Figure):
        return "-" if found is None else f"{found:g}"
    if found.value is None:
        return "-"
    digits = 1 if abs(found.value) >= 100 else 2 if abs(found.value) >= 10 else 3
    text = f"{found.value:.{digits}f}"
    if found.low is not None and found.high is not None:
        text += f" [{found.low:.{digits}f}, {found.high:.{digits}f}]"
    if found.p is not None and found.detects is not None:
        text += "*" * (found.p < 0.05) + f" ±{found.detects:.{digits}f}"
    return text


def rendered(name: str, content: Mapping[str, Any], *, escaped: bool = True) -> str:
    """A template of this package, filled."""
    from markupsafe import Markup, escape

    code = lambda text: Markup(re.sub("`(.*?)`", r"<code>\1</code>", str(escape(text))))  # noqa: E731
    page = template("echousd.evaluation", name, escaped=escaped, code=code, cell=cell, plot=plot)
    return page.render(**content) + "\n"


def plot(table: Table) -> str:
    """A table as SVG, a panel for each column or curve; "" where there is nothing to see.

    Bars have their intervals, every panel a scale of its own.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Canvas

    names, lacking = list(table.rows), Figure(None)
    bars = {column: [table.rows[name].get(column, lacking) for name in names] for column in table.columns}
    bars = {column: found for column, found in bars.items() if any(one.value is not None for one in found)}
    panels = list(table.curves or bars)
    if table.plain or not panels or (not table.curves and len(panels) > PANELS):
        return ""
    lines, across = -(-len(panels) // ACROSS), min(len(panels), ACROSS)
    height = 2.9 if table.curves else 0.8 + 0.14 * len(names)
    with rc_context({"svg.hashsalt": "echousd", "svg.fonttype": "none", "font.size": 7}):
        canvas = Canvas(figsize=(1.4 + 1.9 * across, lines * height), layout="constrained")
        every = list(np.ravel(canvas.subplots(lines, across)))
        for axes in every[len(panels) :]:
            axes.remove()
        for number, (axes, panel) in enumerate(zip(every, panels, strict=False)):
            axes.set_title(panel, fontsize=7.5)
            axes.spines[["top", "right"]].set_visible(False)
            for k, (name, (x, y)) in enumerate(table.curves.get(panel, {}).items()):
                axes.plot(x, y, ["-", "--", ":"][k % 3], label=name, lw=1.2, color=f"C{k % 10}")
            if not table.curves:
                value, low, high = np.array([(f.value, f.low, f.high) for f in bars[panel]], float).T
                reach = np.nan_to_num(np.abs([low - value, high - value]))
                tint = ["#356" if name == names[0] else "#9ab" for name in names]
                axes.barh(range(len(names)), value, xerr=reach, error_kw={"lw": 0.7}, color=tint)
                axes.set_yticks(range(len(names)), names if number % ACROSS == 0 else [""] * len(names))
                axes.invert_yaxis()
        if table.curves:
            every[0].legend(fontsize=6, frameon=False)
        text = io.StringIO()
        canvas.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"<metadata>.*?</metadata>", "", text.getvalue(), flags=re.DOTALL).partition('.dtd">')[2].strip()


def pictures(run: Run) -> dict[str, str]:
    """Contact sheets, PNG as base64: the same rooms by every system, a row each, as plans and from above."""
    names = list(run.made)
    rows: list = []
    for number in np.linspace(0, len(run.tasks) - 1, min(SHOWN, len(run.tasks))).astype(int):
        rows += [replace(made[number], id=name) for name, made in run.made.items() if number < len(made)]
    out = {"The same rooms by every system": sheet(rows, len(names))} if rows else {}
    if run.shown:
        whole = np.concatenate([np.concatenate(list(shown), 1) for shown in run.shown.values()])
        title = f"From above, top to bottom: {', '.join(run.shown)}"
        out[title] = base64.b64encode(encoded(Image.fromarray(whole))).decode()
    return out


def sheet(rooms: Sequence[RoomBoxes], columns: int) -> str:
    """Plans of rooms beside one another, PNG as base64."""
    with tempfile.TemporaryDirectory(prefix="echousd-") as folder:
        path = Path(folder) / "sheet.png"
        plot_rooms(rooms, path, columns=columns, labels=False)
        return base64.b64encode(path.read_bytes()).decode()
