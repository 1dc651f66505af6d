"""Plans as pictures, drawings and stages: what is drawn is what is there, and bad input is one line."""

import json

import ezdxf
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg

from echomodel.vocabulary import vocabulary
from echousd.home import draw
from echousd.home.draw import lines_of, write_dxf
from echousd.home.existing import plan_there
from echousd.home.files import load_home
from echousd.home.graph import HomeGraph
from echousd.home.importing.formats import read_plan
from echousd.home.importing.homes import room_kind
from echousd.home.plan import plan_home

WORDS = "hall door bedroom, hall open_to kitchen"


@pytest.fixture
def file(tmp_path, echousd_command):
    assert echousd_command("new", tmp_path / "flat.yaml", "--rooms", WORDS, "--area", 30).code == 0
    return tmp_path / "flat.yaml"


def test_walls_are_what_cells_have_beside_floors_and_holes():
    plan = plan_home(HomeGraph.from_words(WORDS, area=30))
    lines = list(lines_of(plan))
    walls = [shapely.Polygon(line.points) for line in lines if line.layer == "wall"]
    floors = shapely.union_all([shapely.Polygon(line.points) for line in lines if line.layer == "room"])
    assert floors.area == pytest.approx(plan.area)
    assert all(wall.buffer(-0.01).intersection(floors).area < 1e-6 for wall in walls)
    assert len([line for line in lines if line.layer == "door"]) == 2 * 2  # a leaf and its arc, inside and at the front


def test_a_plan_becomes_a_picture_a_drawing_and_a_stage(file, tmp_path, echousd_command):
    for name in ("plan.png", "plan.svg", "plan.dxf", "plan.usda"):
        done = echousd_command("plan", file, "-o", tmp_path / name, "--json")
        assert done.code == 0, done.err
        areas = json.loads(done.out)["areas"]
    assert (tmp_path / "plan.svg").read_text().count("<path") > 20
    drawing = ezdxf.readfile(tmp_path / "plan.dxf")
    assert drawing.units == 6
    assert {text.dxf.text for text in drawing.modelspace().query("TEXT")} == set(areas)
    plan = plan_there(tmp_path / "plan.usda", load_home(tmp_path / "plan.usda"))
    assert {name: round(area, 3) for name, area in plan.areas.items()} == pytest.approx(areas, abs=5e-3)
    assert plan.broken() == ()


def test_what_is_written_on_a_plan_is_seen_whole(tmp_path, monkeypatch):
    figures = []
    monkeypatch.setattr(draw, "save_figure", lambda figure, path: figures.append(figure))
    plan = plan_home(HomeGraph.from_words("hall door bedroom, hall door kitchen, hall door bathroom, hall door study"))
    draw.draw_plans([plan], tmp_path / "plan.png")
    (figure,) = figures
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    lengths = [note for note in axes.texts if hasattr(note, "xy") and note.get_text()]
    assert [note.get_text() for note in lengths] == [label for *_, label in draw.dimensions_of(plan)]
    for note in lengths:  # what is outside of the axes is not drawn
        assert axes.get_window_extent().contains(*axes.transData.transform(note.xy))
    for name, floor in plan.floors.items():
        (label,) = (text for text in axes.texts if text.get_text().startswith(f"{name}\n"))
        low, high = axes.transData.transform([draw.on_paper(floor).min(0), draw.on_paper(floor).max(0)])
        assert label.get_window_extent().x0 >= low[0]
        assert label.get_window_extent().x1 <= high[0]


def test_plans_side_by_side(file, tmp_path, echousd_command):
    done = echousd_command("plan", file, "-o", tmp_path / "plans.png", "--plans", 2)
    assert done.out.count("plan     3 rooms") == 2, done.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("flat.yaml", "-o", "plan.txt"), "plan.txt: extension '.txt', allowed: .png, .svg, .pdf, .dxf, .json, .usda"),
        (("flat.yaml", "-o", "plan.dxf", "--plans", "2"), "--plans is 2, allowed with a picture"),
        (("flat.yaml", "-o", "flat.yaml.png", "--plans", "99"), "less than or equal to 12"),
        (("room.yaml", "-o", "plan.png"), "room.yaml: no home, allowed: a file with rooms"),
    ],
)
def test_what_cannot_be_planned_is_one_line(file, tmp_path, monkeypatch, echousd_command, words, said):
    (tmp_path / "room.yaml").write_text("room: bedroom\nobjects: [bed]\n")
    monkeypatch.chdir(tmp_path)
    done = echousd_command("plan", *words)
    assert done.code == 2
    assert said in done.err
    assert done.err.count("\n") == 1


def test_a_drawing_tells_what_rooms_are_whatever_their_names(tmp_path):
    kinds = {f"r{number}": row.name for number, row in enumerate(vocabulary().room_types)} | {"hall": "hallway"}
    rooms = [{name: kind for name, kind in kinds.items() if name in (one, "hall")} for one in kinds if one != "hall"]
    for asked in rooms:
        one = next(iter(asked))
        text = f"home: {{area: 30}}\nrooms: {json.dumps(asked)}\nrelations: [hall door {one}]\n"
        (tmp_path / "flat.yaml").write_text(text)
        write_dxf(plan_home(load_home(tmp_path / "flat.yaml")), tmp_path / "flat.dxf")
        _, found = read_plan(tmp_path / "flat.dxf")
        assert {room.name: room_kind(room.words) for room in found.rooms} == asked
