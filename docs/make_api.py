"""Makes docs/API.md from the docstrings of `echousd.__all__` and from the vocabulary.

python docs/make_api.py
"""

import inspect
from pathlib import Path

import echousd
from echomodel.rows import Predicate
from echomodel.rules import rule_set
from echomodel.rules.placements import RULES as PLACES
from echousd.shapes.finishes.harmonies import HARMONIES

PAGE = Path(__file__).with_name("API.md")
ORDER = ("generate", "edit", "check", "render", "export", "load_model", "Room", "RoomOptions")


def page() -> str:
    """The whole page as Markdown."""
    names = [*ORDER, *(name for name in echousd.__all__ if name not in ORDER)]
    parts = ["# API", "", "Made by `python docs/make_api.py` from the docstrings; `import echousd` is all you need."]
    for name in names:
        parts += ["", f"## {name}", "", *_entry(name)]
    return "\n".join([*parts, *_words()]) + "\n"


def _entry(name: str) -> list[str]:
    found = getattr(echousd, name)
    return ["```text", f"echousd.{name}{_signature(found)}", "", inspect.getdoc(found) or "", "```"]


def _meaning(row: Predicate) -> str:
    """What the rule of a relation asks for, or what unites the two where no rule measures them."""
    rule = rule_set("strict").rules.get(row.name)
    if rule is not None and rule.means:
        return rule.means.rstrip(".")
    return f"one {' and '.join(row.unites)}; not measured" if row.unites else "not measured"


def _signature(found: object) -> str:
    parameters = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in inspect.signature(found).parameters.values()  # type: ignore[arg-type]
    ]
    return str(inspect.Signature(parameters)) if len(str(parameters)) < 2000 else "(...)"


def _words() -> list[str]:
    words = echousd.vocabulary()
    lines = ["", "## Words", "", "| category | also called | stands on |", "|---|---|---|"]
    lines += [f"| {row.name} | {', '.join(row.aliases)} | {row.support} |" for row in words.categories]
    lines += ["", "Relations, and what `check` (rules `strict`) asks of the boxes of the first and the second:", ""]
    lines += ["| relation | means | also called | the other way round |", "|---|---|---|---|"]
    lines += [
        f"| {row.name} | {_meaning(row)} | {', '.join(row.aliases)} | {', '.join(row.swapped)} |"
        for row in words.predicates
    ]
    lines += ["", "| place | means | also called | other objects |", "|---|---|---|---|"]
    lines += [
        f"| {row.name} | {inspect.getdoc(PLACES[row.name])} | {', '.join(row.aliases)} | {row.others or ''} |"
        for row in words.placements
    ]
    lines += ["", "Styles are names of your own: objects of one style and category are one asset, and take one of the"]
    lines += [f"palettes' woods and cloths. Palettes of a room: {', '.join(HARMONIES)}."]
    lines += ["", "| room type | also called |", "|---|---|"]
    lines += [f"| {row.name} | {', '.join(row.aliases)} |" for row in words.room_types]
    return lines


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
