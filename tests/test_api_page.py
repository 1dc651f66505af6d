"""docs/API.md is what the docstrings and the vocabulary say, and every public name is there and explains itself."""

import importlib.util
import inspect
import pydoc
import re
from pathlib import Path

import pytest

import echousd
from echousd.checks import CheckReport
from echousd.options import GROUPS, OF_NEW

DOCS = Path(__file__).parents[1] / "docs"


def maker():
    spec = importlib.util.spec_from_file_location("make_api", DOCS / "make_api.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date():
    assert (DOCS / "API.md").read_text("utf-8") == maker().page(), "run python docs/make_api.py"


def test_every_public_name_is_there_and_documented():
    for name in echousd.__all__:
        assert inspect.getdoc(getattr(echousd, name)), name
    assert {"generate", "edit", "check", "render", "export", "load_model"} <= set(echousd.__all__)
    assert set(echousd.__all__) == set(echousd._HOME)


def section(name):
    """What the page says below a heading."""
    return (DOCS / "API.md").read_text("utf-8").split(f"\n## {name}\n")[1].split("\n## ")[0]


@pytest.mark.parametrize(
    ("name", "kind"), [("SceneGraph", echousd.SceneGraph), ("Room", echousd.Room), ("check", CheckReport)]
)
def test_what_people_call_stands_there_in_a_sentence_each(name, kind):
    told = dict(re.findall(r"^\| `(\w+).*?` \| (.+) \|$", section(name), re.MULTILINE))
    fields = getattr(kind, "model_fields", getattr(kind, "__dataclass_fields__", {}))
    called = {one for one in dir(kind) if not one.startswith("_") and one not in fields}
    assert called <= set(told)
    assert all(len(sentence) > 9 for sentence in told.values())
    assert section(name).count("```python") == 1


def test_the_options_of_a_room_stand_in_their_groups():
    groups = re.split(r"^(\w[\w ]+):$", section("RoomOptions"), flags=re.MULTILINE)[1:]
    assert tuple(groups[::2]) == GROUPS
    found = {
        name: group for group, rows in zip(groups[::2], groups[1::2], strict=True)
        for name in re.findall(r"^\| `(\w+)`", rows, re.MULTILINE)
    }  # fmt: skip
    rows = echousd.RoomOptions.model_fields
    assert found == {name: row.json_schema_extra["group"] for name, row in rows.items()}
    assert "| `drafts` | `None` | 1 to 64 | layouts to choose the best from;" in section("RoomOptions")
    assert f"An edit takes {', '.join(f'`{name}`' for name in OF_NEW)}." in section("RoomOptions")


def test_no_module_takes_the_place_of_a_public_name():
    import echousd.cli.main as commands

    commands.command()  # imports every command
    modules = {path.stem for path in Path(echousd.__file__).parent.iterdir()}
    assert not modules & set(echousd.__all__)
    assert all(callable(getattr(echousd, name)) for name in echousd.__all__)


def test_every_measured_word_is_explained():
    from echomodel.rules import rule_set

    rules = rule_set("strict").rules
    assert [name for name, rule in rules.items() if not rule.means] == []
    page = (DOCS / "API.md").read_text("utf-8")
    assert "| facing | The subject's front looks at the object's centre, to 30 degrees, or straight ahead at" in page
    assert "| same_style_as | one style" in page


def test_help_is_short_and_shows_no_names_of_libraries():
    told = pydoc.render_doc(echousd, renderer=pydoc.plaintext)
    assert len(told.splitlines()) < 800
    assert "model_dump" not in told
    node = pydoc.render_doc(echousd.Node, renderer=pydoc.plaintext).splitlines()
    assert len(node) < 50
    assert any("Node(name, category, *, title=None" in line for line in node)
    assert {"add_node", "relate", "diff"} <= set(dir(echousd.SceneGraph))
