"""A study with people: which pairs they see in which order, a page that records their answers, and what they say.

Protocol: every person sees all pairs of two systems for the same room and graph, both as plans and from above with the
same furniture; order and sides are drawn anew for each person from the number that the page draws for them; every
eighth pair comes again with its sides exchanged, and who answers more than half of these otherwise is left out. One
question: in which room would you rather live? "Undecided" is an answer and counts for neither.
"""

from __future__ import annotations

import itertools
import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from scipy.stats import binomtest

from echomodel.files import write_text
from echomodel.metrics.statistics import LEVEL
from echomodel.metrics.tasks import tasks_of
from echomodel.progress import StageListener
from echousd.evaluation.report import rendered, sheet
from echousd.evaluation.runs import SuiteSettings, rooms_against, run_systems
from echousd.evaluation.systems import System

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
    tasks = tasks_of(rooms_against(settings)[0], seed, told=settings.relations)
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
            told = json.loads(file.read_text("utf-8"))["answers"]
            again = [(a["choice"], a["first"]) for a in told if a.get("first") is not None]
            rows = [(a["one"], a["other"], a["choice"]) for a in told if a.get("first") is None]
        except (KeyError, TypeError, json.JSONDecodeError, UnicodeDecodeError) as error:
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
