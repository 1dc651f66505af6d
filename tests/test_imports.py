"""One direction of imports: no circle, and every package knows only those below it."""

import ast
import re
from importlib import import_module
from operator import attrgetter
from pathlib import Path

import networkx
import pytest

from echomodel.late import Late

ROOT = Path(__file__).parents[1]
LINES = 600  # of a module that is read in one sitting
# packages of echousd, those above first; each knows only what stands below its own row
LAYERS = (
    ("cli",),
    ("home",),
    ("batches", "diagnosis", "evaluation"),
    ("checks", "texturing"),
    ("make",),
    ("settle",),
    ("layers", "place"),
    ("dressing", "folder"),
    ("room",),
    ("options",),
    ("shapes",),
    ("assets",),
    ("exporting",),
    ("draw",),
    ("stage",),
    ("store",),
    ("graph",),
    ("invalid", "naming", "pages", "pending", "plugin", "srgb", "textures"),
)
# package -> what else it must not import, in a function or above it (imports for type hints alone are none)
FORBIDDEN = {
    "echomodel": ("echousd", "echoscene", "pxr", "typer", "rich"),
    "echoscene": ("echousd", "pxr", "typer", "rich"),
    "echousd.graph": ("pxr", "torch"),
    "echousd.stage": ("torch", "typer", "rich"),
    "echousd.place": ("pxr", "typer", "rich", "echousd.stage", "echousd.shapes", "echousd.folder"),
    "echousd.checks": ("typer", "rich"),
    "echousd.make": ("typer", "rich"),
}


# what a module has others do for it that build on it: it names them and imports them when it is called
DOORS = {
    "echousd.graph.files": {"echousd.stage.graphs", "echousd.stage.read"},  # graphs in files that are stages
    "echousd.graph.scene": {"echousd.graph.difference", "echousd.graph.text"},  # methods of a graph
    "echousd.place.search": {"echousd.place.building"},
    "echousd.stage.files": {"echousd.folder.found"},  # a room's folder stands for its root layer
    "echousd.stage.read": {"echousd.stage.foreign"},  # stages without a graph
}


def modules():
    """Module name -> path, of all packages."""
    found = {}
    for folder, package in ((ROOT, "echousd"), (ROOT / "model", "echomodel"), (ROOT / "model", "echoscene")):
        for path in (folder / package).rglob("*.py"):
            found[".".join(path.relative_to(folder).with_suffix("").parts).removesuffix(".__init__")] = path
    return found


def imported(path):
    """Names of the modules and objects that a file imports, wherever it does, except for type hints alone."""
    tree = ast.parse(path.read_text("utf-8"))
    hints = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for part in node.body
        for inner in ast.walk(part)
    }
    names = set()
    for node in ast.walk(tree):
        if id(node) in hints:
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def named(path):
    """Modules that a file names in a `Late`, to be imported when they are called."""
    tree = ast.parse(path.read_text("utf-8"))
    words = {
        node.targets[0].id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant) and len(node.targets) == 1
    }
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    places = [ast.unparse(node.args[0]) for node in calls if getattr(node.func, "id", "") in ("Late", "lates")]
    for word, text in words.items():
        places = [place.replace(f"{{{word}}}", str(text)) for place in places]
    return {found[1] for place in places if (found := re.match(r"f?'([\w.]+)", place))}


@pytest.fixture(scope="module")
def imports():
    return {module: imported(path) for module, path in modules().items()}


def test_no_circle(imports):
    graph, doors = networkx.DiGraph(), {module: named(path) & set(imports) for module, path in modules().items()}
    assert sum(map(len, doors.values())) > 40
    for module, others in DOORS.items():
        assert others <= doors[module], module
    for module, names in imports.items():
        for name in names | doors[module] - DOORS.get(module, set()):
            target = name if name in imports else name.rpartition(".")[0]
            if target in imports:
                graph.add_edge(module, target)
    assert graph.number_of_edges() > 300
    assert [sorted(group) for group in networkx.strongly_connected_components(graph) if len(group) > 1] == []


def package_of(module):
    """`echousd.dressing` of `echousd.dressing.floors`, `echousd.naming` of itself."""
    return ".".join(module.split(".")[:2])


@pytest.mark.parametrize(("whole", "edges"), [("echousd", 40), ("echomodel", 40)])
def test_no_circle_between_packages(imports, whole, edges):
    graph = networkx.DiGraph()
    for module, names in imports.items():
        for name in names:
            target = name if name in imports else name.rpartition(".")[0]
            packages = {package_of(module), package_of(target)}
            if target in imports and len(packages) == 2 and all(name.startswith(f"{whole}.") for name in packages):
                graph.add_edge(package_of(module), package_of(target))
    assert graph.number_of_edges() > edges
    assert [sorted(group) for group in networkx.strongly_connected_components(graph) if len(group) > 1] == []


@pytest.mark.parametrize("package", FORBIDDEN)
def test_packages_know_only_those_below(imports, package):
    wrong = [
        f"{module} imports {name}"
        for module, names in imports.items()
        if f"{module}.".startswith(f"{package}.")
        for name in sorted(names)
        if f"{name}.".startswith(tuple(f"{other}." for other in FORBIDDEN[package]))
    ]
    assert wrong == []


@pytest.mark.parametrize("module", [module for module, path in modules().items() if named(path)])
def test_functions_that_are_called_late_are_there(module):
    found = [*vars(import_module(module)).values()]
    found += [row for table in found if isinstance(table, dict) for row in table.values()]
    for late in (one for one in found if isinstance(one, Late)):
        assert callable(late.itself), late.place


def test_a_hint_is_no_import_and_a_function_hides_none(tmp_path):
    path = tmp_path / "module.py"
    path.write_text("if TYPE_CHECKING:\n    from a import b\n\ndef f():\n    from c import d\n    import e.f\n")
    assert imported(path) == {"c.d", "e.f"}


def test_the_page_on_architecture_names_files_that_there_are():
    page = (ROOT / "docs" / "ARCHITECTURE.md").read_text("utf-8")
    named = set(re.findall(r"`((?:echousd|echomodel|model|tests)/[\w/.]+)`", page))
    assert len(named) > 20
    assert [name for name in sorted(named) if not any((top / name).exists() for top in (ROOT, ROOT / "model"))] == []


def test_packages_stand_in_layers(imports):
    row = {f"echousd.{name}": number for number, names in enumerate(LAYERS) for name in names}
    packages = {package_of(module) for module in imports if module.startswith("echousd.")}
    assert packages == set(row)
    wrong = [
        f"{module} imports {name}"
        for module, names in imports.items()
        for name in sorted(names)
        if row.get(package_of(name), len(LAYERS)) <= row.get(package_of(module), -1)
        and package_of(name) != package_of(module)
    ]
    assert wrong == []


def test_modules_are_read_in_one_sitting():
    files = [path for folder in ("echousd", "model", "tests", "benchmarks") for path in (ROOT / folder).rglob("*.py")]
    long = [str(path.relative_to(ROOT)) for path in files if len(path.read_text("utf-8").splitlines()) > LINES]
    assert len(files) > 400
    assert long == []


SCRIPTS = sorted([*ROOT.glob("benchmarks/*.py"), *ROOT.glob("docs/*.py")])


@pytest.mark.parametrize("script", SCRIPTS, ids=attrgetter("stem"))
def test_scripts_import_what_there_is(script):
    """What moves between modules is not forgotten where no test runs the script."""
    found = [node for node in ast.walk(ast.parse(script.read_text("utf-8"))) if isinstance(node, ast.ImportFrom)]
    for node in (one for one in found if one.module and one.module.startswith("echo")):
        for each in node.names:
            if not hasattr(import_module(node.module), each.name):
                import_module(f"{node.module}.{each.name}")
