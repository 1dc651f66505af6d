"""Makes docs/API.md from the docstrings of `echousd.__all__` and from the vocabulary.

python docs/make_api.py
"""

import inspect
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import echousd
from echomodel.rows import Predicate
from echomodel.rules import rule_set
from echomodel.rules.placements import RULES as PLACES
from echousd.checks import CheckReport, Collision, Fault, Misplacement
from echousd.checks.report import LayoutReport
from echousd.graph.changes import EditRequest
from echousd.graph.difference import GraphDiff
from echousd.graph.nodes import PlainModel
from echousd.home.assemble import Made
from echousd.home.graph import HomeRelation, HomeRoom
from echousd.home.importing.homes import Imported
from echousd.home.plan import HomePlan
from echousd.invalid import limits_of
from echousd.options import GROUPS, OF_NEW, RoomOptions, words_of
from echousd.place.living import LivingFault
from echousd.room import LayoutOutcome, Provenance, Verdict
from echousd.settle.settle import Motion, SettleReport
from echousd.shapes.finishes.slots import HARMONIES

PAGE = Path(__file__).with_name("API.md")
ORDER = ("SceneGraph", "generate", "Room", "RoomOptions", "edit", "update", "adopt", "undo", "redo", "check", "render",
         "export", "load_model", "HomeGraph", "plan_home", "generate_home", "import_plan")  # fmt: skip
# what a name gives that has no public name of its own
GIVES = {
    "edit": (EditRequest,),
    "SceneGraph": (GraphDiff,),
    "Room": (LayoutOutcome, Verdict, Provenance),
    "HomeGraph": (HomeRoom, HomeRelation),
    "plan_home": (HomePlan,),
    "generate_home": (Made,),
    "import_plan": (Imported,),
    "check": (
        CheckReport, LayoutReport, Collision, Misplacement, LivingFault, Fault, SettleReport, Motion,
    ),
}  # fmt: skip
# run by tests/test_readme.py, top to bottom in one folder
EXAMPLES = {
    "SceneGraph": r"""
import echousd

graph = echousd.SceneGraph(
    echousd.RoomSpec("study", size=(3.6, 3.0)),
    (echousd.Node("desk", "desk"), echousd.Node("chair", "office_chair")),
    (echousd.Relation("chair", "close_by", "desk"),),
)
more = graph.add_node("lamp", "table_lamp").relate("lamp", "standing on", "desk").lock("lamp")
print("\n".join(graph.diff(more).lines()))
assert echousd.SceneGraph.from_yaml(more.to_yaml()) == more
echousd.write_graph(more, "study.usda")
""",
    "Room": r"""
import echousd

room = echousd.generate("study.usda", seed=7, shapes="boxes", dress="none", preview=False)
for number, name in enumerate(room.names):
    x, height, z = room.pose(number)[:3, 3]  # metres
    print(f"{name:>5} at x {x:+.2f}, height {height:.2f}, z {z:+.2f}")
print(*room.verdicts, *room.faults, sep="\n")
print(room.stage.GetDefaultPrim().GetPath(), room.save("out/study"))
""",
    "edit": r"""
import echousd

room = echousd.edit("out/study", add=["shelf:bookshelf"], relate=["shelf left of desk"], lock="desk", shapes="boxes")
room.save("out/study")
print(*echousd.undo("out/study"), sep="\n")  # as it was; echousd.redo makes it again
""",
    "check": r"""
import echousd

report = echousd.check("out/study/study.usda")
for fault in (*report.collisions, *report.placement, *report.errors):
    print(fault)
for one in report.relations:
    print(one.sentence, one.state, one.margin)
print(report.ok, report.good(strict=True), sorted(report.to_json()))
""",
    "generate_home": r"""
import echousd

home = echousd.HomeGraph.from_words("hall open_to living, hall door bedroom", area=44).relate("bedroom north of hall")
plan = echousd.plan_home(home, seed=3)
print({name: round(area, 1) for name, area in plan.areas.items()}, plan.broken())
made = echousd.generate_home(plan, "out/flat", seed=3, shapes="boxes", dress="none", preview=False)
print(made.root, {name: row["objects"] for name, row in made.rooms.items()}, made.failed)
""",
}


def page() -> str:
    """The whole page as Markdown."""
    names = [*ORDER, *(name for name in echousd.__all__ if name not in ORDER)]
    parts = ["# API", "", "Made by `python docs/make_api.py` from the docstrings; `import echousd` is all you need."]
    for name in names:
        parts += ["", f"## {name}", "", *_entry(name)]
    return "\n".join([*parts, *_words()]) + "\n"


def _entry(name: str) -> list[str]:
    found = getattr(echousd, name)
    lines = _described(f"echousd.{name}", found)
    if found is RoomOptions:
        lines += _options()
    for kind in GIVES.get(name, ()):
        lines += ["", *_described(kind.__name__, kind)]
    return [*lines, "", "```python", EXAMPLES[name].strip(), "```"] if name in EXAMPLES else lines


def _described(title: str, found: Any) -> list[str]:
    """Signature, docstring and members, of a class also those of the classes of ours that it builds on."""
    kinds = [kind for kind in inspect.getmro(found) if _ours(kind)] if inspect.isclass(found) else [found]
    docs = [inspect.getdoc(kind) or "" for kind in kinds if kind is not PlainModel]
    lines = ["```text", f"{title}{_signature(found)}", "", *"\n\n".join(docs).split("\n"), "```"]
    members = [f"| `{called}` | {_first_sentence(member)} |" for kind in kinds for called, member in _members(kind)]
    return [*lines, "", "| member | what it is |", "|---|---|", *dict.fromkeys(members)] if members else lines


def _ours(kind: type) -> bool:
    return kind.__module__.startswith(("echousd", "echomodel"))


def _members(kind: Any) -> Iterator[tuple[str, Any]]:
    for name, member in vars(kind).items() if inspect.isclass(kind) else ():
        if name.startswith("_") or (inspect.getdoc(member) or "The entry").startswith("The entry"):
            continue
        if isinstance(member, property | cached_property):
            yield name, member
        elif inspect.isroutine(member):
            yield f"{name}{_signature(getattr(kind, name))}", member


def _first_sentence(member: Any) -> str:
    text = " ".join((inspect.getdoc(member) or "").split("\n\n")[0].split())
    return text.replace("|", "or")


def _options() -> list[str]:
    lines = []
    for group in GROUPS:
        lines += ["", f"{group}:", "", "| option | default | allowed | what it does |", "|---|---|---|---|"]
        for name, row in RoomOptions.model_fields.items():
            extra: Any = row.json_schema_extra
            if extra["group"] == group:
                allowed = limits_of(row) or words_of(row).replace("|", ", ")
                lines.append(f"| `{name}` | `{row.default!r}` | {allowed} | {row.description} |")
    return [*lines, "", f"An edit takes {', '.join(f'`{name}`' for name in OF_NEW)}."]


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
        if parameter.name != "self"
    ]
    left = [one for one in parameters if one.name not in RoomOptions.model_fields]
    if len(parameters) - len(left) < len(OF_NEW):  # else the table has them
        return str(inspect.Signature(parameters))
    return str(inspect.Signature([*left, inspect.Parameter("given", inspect.Parameter.VAR_KEYWORD)]))


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
