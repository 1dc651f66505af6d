"""Floor plans of others: one flat in every format becomes the same home, and what cannot be one is told in a line."""

import json
import zipfile
from itertools import pairwise

import ezdxf
import numpy as np
import pytest
import svgelements

from echousd.graph import GraphError
from echousd.home.existing import plan_there
from echousd.home.files import load_home
from echousd.home.importing.formats import import_plan, read_plan
from echousd.home.importing.found import Drawn, Hole, Room, rooms_between
from echousd.home.importing.homes import imported, room_kind
from echousd.home.plan import ways

# A flat as maps have it, x east, y north: a bedroom and east of it a hall, their wall at x = 4.
ROOMS = {"Bedroom": [(0, 0), (4, 0), (4, 3), (0, 3)], "Hall": [(4, 0), (6, 0), (6, 3), (4, 3)]}
DOOR, FRONT, WINDOW = ((4, 1), (4, 1.9)), ((4.5, 0), (5.4, 0)), ((1, 3), (2.4, 3))
BED = (1.2, 1.5)  # middle of a bed 1.6 m wide and 2 m deep, which looks east


def dxf(path, unit=4, scale=1000.0):
    drawing = ezdxf.new(units=unit)
    space = drawing.modelspace()
    bed = drawing.blocks.new("double bed")
    bed.add_lwpolyline([(-1000, -800), (1000, -800), (1000, 800), (-1000, 800)], close=True)
    for name, corners in ROOMS.items():
        space.add_lwpolyline(np.array(corners) * scale, close=True, dxfattribs={"layer": "A-ROOM"})
        space.add_text(name, dxfattribs={"layer": "A-ROOM"}).set_placement(np.mean(corners, 0) * scale)
    for (hinge, _end), start in ((DOOR, 90), (FRONT, 0)):
        arc = {"radius": 0.9 * scale, "start_angle": start, "end_angle": start + 90}
        space.add_arc(np.array(hinge) * scale, **arc, dxfattribs={"layer": "DOORS"})
    space.add_line(*(np.array(WINDOW) * scale), dxfattribs={"layer": "Fenster"})
    space.add_blockref("double bed", np.array(BED) * scale, dxfattribs={"layer": "Möbel"})
    drawing.saveas(path)


def svg(path):
    drawn = "".join(
        f'<polygon class="room" id="{name}" points="{" ".join(f"{x * 100},{-y * 100}" for x, y in corners)}"/>'
        for name, corners in ROOMS.items()
    )
    for kind, ends in (("door", DOOR), ("door", FRONT), ("window", WINDOW)):
        (x1, y1), (x2, y2) = np.array(ends) * (100, -100)
        drawn += f'<g class="{kind}"><line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"/></g>'
    drawn += '<rect class="furniture" id="double bed" x="20" y="-230" width="200" height="160"/>'
    path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 -300 600 300" width="60mm">{drawn}</svg>')
    assert svgelements.SVG.parse(str(path))


def sh3d(path):
    rooms = "".join(
        f"<room name='{name}'>" + "".join(f"<point x='{x * 100}' y='{-y * 100}'/>" for x, y in corners) + "</room>"
        for name, corners in ROOMS.items()
    )
    holes = ""
    for name, ends, turn, more in (
        ("Door", DOOR, 1.5707963, "height='200'"),
        ("Front door", FRONT, 0, "height='210'"),
        ("Window", WINDOW, 0, "height='120' elevation='95'"),
    ):
        x, y = np.mean(ends, 0) * (100, -100)
        about = f"name='{name}' x='{x}' y='{y}' angle='{turn}' width='{140 if name == 'Window' else 90}' depth='10'"
        holes += f"<doorOrWindow {about} {more}><sash/></doorOrWindow>"
    bed = (
        "<pieceOfFurniture name='Double bed' x='120' y='-150' angle='-1.5707963' width='160' depth='200' height='70'/>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("Home.xml", f"<home version='6500' wallHeight='250'>{bed}{rooms}{holes}</home>")


def wall(name, start, end, room):
    low = [{"x": x, "y": 0, "z": z} for x, z in (start, end)]
    return {"id": name, "roomId": room, "polygon": low + [{**corner, "y": 2.5} for corner in low]}


def procthor(path, holodeck=False):
    rooms = [
        {"id": f"room|{name}", "roomType": name, "floorPolygon": [{"x": x, "y": 0, "z": z} for x, z in corners]}
        for name, corners in ROOMS.items()
    ]
    walls = [wall("east", (4, 3), (4, 0), "room|Bedroom"), wall("north", (0, 3), (4, 3), "room|Bedroom")]
    walls += [wall("south", (4, 0), (6, 0), "room|Hall")]
    found = {"rooms": rooms, "walls": walls, "windows": [], "doors": [], "metadata": {"schema": "1.0.0"}}
    for kind, name, wall0, low, high, ends in (
        ("doors", "door", "east", (1.1, 0), (2.0, 2.0), DOOR),
        ("doors", "front", "south", (0.5, 0), (1.4, 2.1), FRONT),
        ("windows", "window", "north", (1.0, 0.9), (2.4, 2.2), WINDOW),
    ):
        hole = [{"x": x, "y": y, "z": 0} for x, y in (low, high)]
        one = {"id": name, "assetId": "Doorway_1", "wall0": wall0, "holePolygon": hole}
        if holodeck:
            one |= {f"{kind[:-1]}Segment": [list(end) for end in ends], "wall0": "unknown"}
        found[kind].append(one)
    bed = {"id": "Bed|2|0", "position": {"x": BED[0], "y": 0.4, "z": BED[1]}, "rotation": {"x": 0, "y": 90, "z": 0}}
    found["objects"] = [{**bed, "assetId": "Bed_1", "children": [{"id": "Pillow|1"}]}]
    path.write_text(json.dumps(found))


def scenesmith(path):
    placed = []
    for name, (low, _, high, _) in ROOMS.items():
        sides = {"south": (low, (high[0], low[1])), "north": ((low[0], high[1]), high)}
        sides |= {"west": (low, (low[0], high[1])), "east": ((high[0], low[1]), high)}
        walls = [
            {"wall_id": f"{name}_{way}", "start_point": a, "end_point": b, "openings": []}
            for way, (a, b) in sides.items()
        ]
        placed.append({"room_id": name, "position": low, "width": 4, "depth": 3, "walls": walls})
    door = {
        "opening_id": "door",
        "opening_type": "door",
        "position_along_wall": 1.0,
        "width": 0.9,
        "height": 2.0,
        "sill_height": 0,
    }
    placed[0]["walls"][3]["openings"] = [door]
    placed[1]["walls"][2]["openings"] = [door]
    placed[1]["walls"][0]["openings"] = [{**door, "opening_id": "front", "position_along_wall": 0.5}]
    window = {**door, "opening_id": "window", "opening_type": "window", "width": 1.4, "height": 1.3, "sill_height": 0.9}
    placed[0]["walls"][1]["openings"] = [window]
    rooms = [{"id": name, "type": name.lower()} for name in ROOMS]
    path.write_text(json.dumps({"wall_height": 2.7, "rooms": rooms, "placed_rooms": placed}))


def sage(path):
    rooms = []
    for name, corners in ROOMS.items():
        walls = [
            {"id": f"{name}{i}", "start_point": dict(zip("xyz", (*corners[i], 0), strict=True)),
             "end_point": dict(zip("xyz", (*corners[(i + 1) % 4], 0), strict=True))}
            for i in range(4)
        ]  # fmt: skip
        rooms.append({"id": name, "room_type": name, "walls": walls, "doors": [], "windows": [], "objects": []})
    rooms[0]["doors"] = [
        {"id": "door", "wall_id": "Bedroom1", "position_on_wall": 1.45 / 3, "width": 0.9, "height": 2.0}
    ]
    rooms[1]["doors"] = [{"id": "front", "wall_id": "Hall0", "position_on_wall": 0.95 / 2, "width": 0.9, "height": 2.1}]
    rooms[0]["windows"] = [
        {"id": "w", "wall_id": "Bedroom2", "position_on_wall": 2.3 / 4, "width": 1.4, "height": 1.3, "sill_height": 0.9}
    ]
    size = {"width": 1.6, "length": 2.0, "height": 0.6}
    bed = {"type": "bed", "position": {"x": BED[0], "y": BED[1], "z": 0}, "rotation": {"z": 270}, "dimensions": size}
    rooms[0]["objects"] = [bed]
    path.write_text(json.dumps({"rooms": rooms}))


def infinigen(path):
    def shape(kind, points):
        return {"shape": f"shapely.{kind}({[tuple(map(float, p)) for p in points]})"}

    found = {"rooms": {f"{name.lower()}_0/0": shape("Polygon", corners) for name, corners in ROOMS.items()}}
    found["doors"] = {"door": shape("LineString", DOOR)}
    found["entrance"] = shape("LineString", FRONT)
    found["windows"] = {"window": {"operation": "shapely.LineString", "args": [WINDOW]}}
    path.write_text(json.dumps(found))


def test_holes_of_infinigen_are_of_the_storey_in_whose_walls_they_lie(tmp_path):
    def shape(kind, *points):
        return {"shape": f"shapely.{kind}({[*points]})"}

    rooms = {"hallway_0/0": shape("Polygon", (0, 0), (4, 0), (4, 3), (0, 3))}
    rooms |= {"bedroom_1/0": shape("Polygon", (0, 0), (2, 0), (2, 3), (0, 3))}
    rooms |= {"study_1/0": shape("Polygon", (2, 0), (4, 0), (4, 3), (2, 3))}
    doors = {"door": shape("LineString", (2, 1), (2, 1.9)), "door.001": shape("LineString", (1, 0), (1.9, 0))}
    (tmp_path / "flat.json").write_text(json.dumps({"rooms": rooms, "doors": doors}))
    _, found = read_plan(tmp_path / "flat.json")
    assert [hole.storey for hole in found.holes] == ["1", ""]  # both have a wall at the second
    assert imported(found).counts["doors"] == 1
    upstairs = imported(found, "1")
    assert [frozenset(pair) for pair, _ in ways(upstairs.plan)] == [frozenset(upstairs.plan.floors)]


def roomplan(path):
    turn = np.radians(20)  # a scan begins however the phone is held
    cos, sin = np.cos(turn), np.sin(turn)

    def surface(ends, height, low=0.0, more=()):
        (x1, y1), (x2, y2) = ends  # +X is north, +Z east
        north, east, along = (y1 + y2) / 2, (x1 + x2) / 2, np.array([y2 - y1, x2 - x1])
        length = float(np.hypot(*along))
        forth = along / length
        axes = np.array([[forth[0], 0, -forth[1]], [0, 1, 0], [forth[1], 0, forth[0]]])
        return placed(axes, (north, low + height / 2, east), [length, height, 0.0]) | dict(more)

    def placed(axes, middle, size):
        matrix = np.eye(4)
        around = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
        matrix[:3, :3], matrix[:3, 3] = around @ axes, around @ middle
        return {
            "transform": matrix.T.ravel().tolist(),
            "dimensions": size,
            "identifier": "x",
            "confidence": {"high": {}},
        }

    scans = []
    for name, corners in ROOMS.items():
        inner = [(x + (0.05 if x < 4.01 and name == "Hall" and x == 4 else 0), y) for x, y in corners]
        walls = [surface((inner[i], inner[(i + 1) % 4]), 2.6) for i in range(4)]
        floor = placed(np.eye(3), (0, 0, 0), [1, 1, 0]) | {"polygonCorners": [[y, 0, x] for x, y in inner]}
        sections = [{"label": {"Hall": "hallway"}.get(name, name.lower())}]
        scans.append(
            {
                "walls": walls,
                "floors": [floor],
                "doors": [],
                "windows": [],
                "openings": [],
                "objects": [],
                "sections": sections,
                "story": 0,
            }
        )
    scans[0]["doors"] = [surface(DOOR, 2.0)]
    scans[1]["doors"] = [surface(FRONT, 2.0)]
    scans[0]["windows"] = [surface(WINDOW, 1.3, 0.9)]
    scans[0]["objects"] = [placed(np.eye(3), (BED[1], 0.3, BED[0]), [1.6, 0.6, 2.0]) | {"category": {"bed": {}}}]
    path.write_text(json.dumps({"rooms": scans}))


def ifc(path, units=True):
    ifcopenshell = pytest.importorskip("ifcopenshell")
    from ifcopenshell import api

    file = ifcopenshell.file(schema="IFC4")
    project = api.run("root.create_entity", file, ifc_class="IfcProject", name="P")
    if units:
        api.run("unit.assign_unit", file, length={"is_metric": True, "raw": "MILLIMETERS"})
    context = api.run("context.add_context", file, context_type="Model")
    body = api.run(
        "context.add_context",
        file,
        context_type="Model",
        context_identifier="Body",
        target_view="MODEL_VIEW",
        parent=context,
    )
    storey = api.run("root.create_entity", file, ifc_class="IfcBuildingStorey", name="Ground")
    api.run("aggregate.assign_object", file, products=[storey], relating_object=project)

    def box(kind, name, low, high):
        low, high = np.array(low) * 1000.0, np.array(high) * 1000.0
        one = api.run("root.create_entity", file, ifc_class=kind, name=name)
        profile = file.createIfcRectangleProfileDef(
            "AREA", None, file.createIfcAxis2Placement2D(file.createIfcCartesianPoint([0.0, 0.0])), *(high - low)[:2]
        )
        at = file.createIfcCartesianPoint([*((low + high) / 2)[:2], low[2]])
        solid = file.createIfcExtrudedAreaSolid(
            profile,
            file.createIfcAxis2Placement3D(at),
            file.createIfcDirection([0.0, 0.0, 1.0]),
            float(high[2] - low[2]),
        )
        shape = file.createIfcShapeRepresentation(body, "Body", "SweptSolid", [solid])
        api.run("geometry.assign_representation", file, product=one, representation=shape)
        api.run("geometry.edit_object_placement", file, product=one)
        where = "aggregate.assign_object" if kind == "IfcSpace" else "spatial.assign_container"
        relating = "relating_object" if kind == "IfcSpace" else "relating_structure"
        api.run(where, file, products=[one], **{relating: storey})
        return one

    for name, (low, _, high, _) in ROOMS.items():
        box("IfcSpace", name, (*low, 0), (*high, 2.6))
    box("IfcDoor", "Door", (3.95, 1, 0), (4.05, 1.9, 2.0))
    box("IfcDoor", "Front", (4.5, -0.1, 0), (5.4, 0.0, 2.1))
    box("IfcWindow", "Window", (1, 3, 0.9), (2.4, 3.1, 2.2))
    box("IfcFurniture", "Double bed", (BED[0] - 1, BED[1] - 0.8, 0), (BED[0] + 1, BED[1] + 0.8, 0.6))
    file.write(str(path))


def test_two_doors_between_two_rooms_are_no_passage():
    rooms = [Room(name, (name,), np.array(corners, float)) for name, corners in ROOMS.items()]
    holes = [Hole(f"d{n}", "door", np.array([[(4.0, at), (4.0, at + 0.8)]])) for n, at in enumerate((0.2, 1.8))]
    counts = imported(Drawn("metres", rooms, holes)).counts
    assert (counts["doors"], counts["passages"]) == (2, 0)


PLANS = {
    "dxf": (dxf, "flat.dxf", None), "svg": (svg, "flat.svg", 0.01), "sweethome": (sh3d, "flat.sh3d", None),
    "procthor": (procthor, "flat.json", None), "holodeck": (lambda path: procthor(path, True), "flat.json", None),
    "scenesmith": (scenesmith, "flat.json", None), "sage": (sage, "flat.json", None), "ifc": (ifc, "flat.ifc", None),
    "infinigen": (infinigen, "flat.json", None), "roomplan": (roomplan, "flat.json", None),
}  # fmt: skip
WITHOUT_FURNITURE = ("scenesmith", "infinigen")


@pytest.mark.parametrize("form", PLANS)
def test_one_flat_in_every_format(form, tmp_path):
    write, name, unit = PLANS[form]
    write(tmp_path / name)
    read, found = read_plan(tmp_path / name, None, unit)
    assert read == {"holodeck": "procthor"}.get(form, form)
    made = imported(found)
    plan = made.plan
    assert [room.type for room in plan.home.rooms] == ["bedroom", "hallway"]
    bedroom, hall = plan.floors
    assert (made.counts["doors"], made.counts["windows"]) == (2, 1)
    ((pair, door),) = ways(plan)
    assert {*pair} == {bedroom, hall}
    assert (door.kind, round(door.width, 2)) == ("door", 0.9)
    assert plan.broken() == ()
    low, high = (
        np.array(f([corners for floor in plan.floors.values() for corners in floor], 0)) for f in (np.min, np.max)
    )
    north, east = high - low
    assert (north, east) == pytest.approx((3.0, 6.0), abs=0.06), "3 m north, 6 m east"
    assert plan.floors[bedroom][:, 1].max() <= plan.floors[hall][:, 1].min(), "the hall lies east of the bedroom"
    (window,) = [opening for opening in plan.openings[bedroom] if opening.kind == "window"]
    start, end = plan.floors[bedroom][[window.edge, (window.edge + 1) % 4]]
    assert start[0] == end[0] == plan.floors[bedroom][:, 0].max(), "in the north wall"
    assert window.width == pytest.approx(1.4, abs=0.02)
    (front,) = [opening for opening in plan.openings[hall] if opening != door and opening.kind == "door"]
    assert plan.floors[hall][[front.edge, (front.edge + 1) % 4], 0] == pytest.approx(low[0]), "in the south wall"
    fixed = [node for node in plan.home.room(bedroom).graph.nodes if node.locked]
    if form in WITHOUT_FURNITURE:
        assert not fixed
        assert len(plan.home.room(bedroom).graph.nodes) > 2, "what bedrooms usually hold"
        return
    (bed,) = fixed
    assert "bed" in bed.category
    x, z = np.array(bed.position)[[0, 2]] + plan.origin(bedroom)
    assert (x - low[0], z - low[1]) == pytest.approx((1.5, 1.2), abs=0.03)
    assert (np.sin(bed.yaw), np.cos(bed.yaw)) == pytest.approx((0.0, 1.0), abs=0.02), "it looks east"


def test_walls_alone_enclose_rooms(tmp_path):
    drawing = ezdxf.new(units=6)
    space = drawing.modelspace()
    corners = (0, 0), (6, 0), (6, 3), (0, 3), (0, 0)
    for start, end in (*pairwise(corners), ((4, 0), (4, 1)), ((4, 1.9), (4, 3))):
        space.add_line(start, end, dxfattribs={"layer": "Wand"})
    space.add_line(*DOOR, dxfattribs={"layer": "Tür"})
    space.add_text("Flur", dxfattribs={"layer": "Text"}).set_placement((5, 1.5))
    space.add_text("Schlafzimmer 1", dxfattribs={"layer": "Text"}).set_placement((2, 1.5))
    drawing.saveas(tmp_path / "flat.dxf")
    made = imported(read_plan(tmp_path / "flat.dxf")[1])
    assert {room.name: room.type for room in made.plan.home.rooms} == {"flur": "hallway", "schlafzimmer_1": "bedroom"}
    assert [{*pair} for pair, _ in ways(made.plan)] == [{"flur", "schlafzimmer_1"}]
    assert made.plan.area == pytest.approx(18, abs=0.8)


def test_thick_walls_are_no_rooms():
    outer = [(0, 0), (6, 0), (6, 4), (0, 4), (0, 0)]
    inner = [(0.2, 0.2), (5.8, 0.2), (5.8, 3.8), (0.2, 3.8), (0.2, 0.2)]
    (room,) = rooms_between([np.array(outer, float), np.array(inner, float)])
    assert np.ptp(room, 0) == pytest.approx((5.6, 3.6), abs=0.02)


@pytest.mark.parametrize(
    ("words", "kind"),
    [(("Master Bedroom 2",), "bedroom"), (("", "Küche"), "kitchen"), (("LivingRoom",), "living_room"),
     (("Cuisine",), "kitchen"), (("WC",), "bathroom"), (("R 1.04", "xyz"), None), (("dining-room",), "dining_room"),
     (("Salle de bain",), "bathroom")],
)  # fmt: skip
def test_the_kind_of_a_room_is_in_its_words(words, kind):
    assert room_kind(words) == kind


def rectangle(name, low, high, **more):
    return Room(name, (name,), np.array([low, (high[0], low[1]), high, (low[0], high[1])], float), **more)


SOUND = rectangle("bedroom", (0, 0), (3, 4))
ASTRAY = Hole("door_1", "door", np.array([[(1.0, 9.0), (1.9, 9.0)]]))


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (Drawn("", [SOUND, rectangle("hall", (2, 0), (5, 4))]), "rooms 'bedroom' and 'hall' overlap by 4.00 m²"),
        (Drawn("", [Room("hall", (), np.array([(0.0, 0.0), (1.0, 1.0)]))]), "'hall': an open outline of 2 corners"),
        (Drawn("", [Room("hall", (), np.array([(0.0, 0), (2, 2), (2, 0), (0, 2)]))]), "outline crosses itself"),
        (Drawn("", [rectangle("hall", (0, 0), (0.3, 0.4))]), "room 'hall': 0.12 m² of floor, allowed: at least 0.5"),
        (Drawn("", [rectangle("hall", (0, 0), (300, 400))]), "120000 m² of floor, allowed: at most 5000 (see --unit)"),
        (Drawn("", [Room("hall", (), np.array([(0, 0), (np.nan, 0), (2, 2.0)]))]), "an open outline of 3 corners"),
        (Drawn("", [SOUND], [ASTRAY]), "door 'door_1' at 1.45 m north, 9.00 m east meets no wall of a room"),
        (Drawn("", []), "no rooms, allowed: at least one"),
    ],
)  # fmt: skip
def test_a_plan_that_cannot_be_one_is_a_line(found, said):
    with pytest.raises(GraphError) as caught:
        imported(found)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_does_not_fit_can_be_left_out_and_is_told():
    made = imported(Drawn("", [SOUND], [ASTRAY, ASTRAY]), lenient=True)
    assert made.ignored == {"doors that meet no wall": 2}
    upper = rectangle("study", (0, 0), (3, 4), storey="1")
    both = Drawn("", [rectangle("hall", (0, 0), (3, 4), storey="0"), upper], storeys=("0", "1"))
    assert [room.name for room in imported(both).plan.home.rooms] == ["hall"]
    assert imported(both).ignored == {"rooms of other storeys": 1}
    assert [room.name for room in imported(both, "1").plan.home.rooms] == ["study"]
    with pytest.raises(GraphError, match=r"no storey '2', allowed: '0', '1'"):
        imported(both, "2")
    with pytest.raises(GraphError, match="no storey '2', allowed: to leave it out, as the plan names none"):
        imported(Drawn("", [rectangle("hall", (0, 0), (3, 4))]), "2")


def many_lines(path):
    drawing = ezdxf.new(units=6)
    for number in range(10_000):
        drawing.modelspace().add_line((number, 0), (number, 1))
    drawing.saveas(path)


def unclear(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())


def archive(path, **files):
    with zipfile.ZipFile(path, "w") as packed:
        for name, text in files.items():
            packed.writestr(name.replace("_", "."), text)


def altered(path, write, old, new):
    write(path)
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


BAD = {
    "flat.dxf": {
        "states no unit ($INSUNITS), allowed: --unit m, cm, mm": lambda path: dxf(path, unit=0),
        "no rooms; layers: 0 (10000); allowed: closed lines on a layer such as 'room'": many_lines,
        "cannot be read as DXF": lambda path: unclear(path, "no drawing"),
    },
    "flat.svg": {
        "an SVG has no scale, allowed: --unit": svg,
        "defines entities": lambda path: unclear(path, '<!DOCTYPE s [<!ENTITY a "b">]><svg/>'),
        "cannot be read as SVG": lambda path: unclear(path, "<svg"),
    },
    "flat.sh3d": {
        "no Home.xml (before Sweet Home 3D 5.3": lambda path: archive(path, Home="java"),
        "not as sh3d has it (cannot be read (": lambda path: unclear(path, "no archive"),
        "Home.xml cannot be read as XML": lambda path: archive(path, Home_xml="<home"),
        "open outline": lambda path: archive(path, Home_xml="<home><room><point x='1' y='2'/></room></home>"),
    },
    "flat.json": {
        "no plan that is known, allowed: JSON of scenesmith, procthor": lambda path: unclear(path, '{"rooms": []}'),
        "not as json has it": lambda path: unclear(path, '{"rooms'),
        "not as json has it ('z' is missing)": lambda path: unclear(
            path, '{"rooms": [{"id": 1, "roomType": "a", "floorPolygon": [{"x": 1}]}]}'
        ),
        "allowed: shapely.box, Polygon or LineString of numbers": lambda path: unclear(
            path, '{"rooms": {"a": {"shape": "exit(1)"}}}'
        ),
        "not as json has it (a hole of 'archway': String should match pattern": lambda path: altered(
            path, scenesmith, '"opening_type": "window"', '"opening_type": "archway"'
        ),
        "not as json has it (a hole of [2.0]: Input should be a valid number)": lambda path: altered(
            path, scenesmith, '"height": 2.0', '"height": [2.0]'
        ),
        "not as json has it (IllegalArgumentException": lambda path: altered(
            path, procthor, '"floorPolygon": [{"x": 0', '"floorPolygon": [{"x": NaN'
        ),
        "malformed node": lambda path: unclear(path, '{"rooms": {"a": {"shape": "shapely.Polygon(exit(1))"}}}'),
    },
    "flat.ifc": {
        "cannot be read as IFC": lambda path: unclear(path, "no building"),
        "states no units, allowed: --unit": lambda path: ifc(path, units=False),
    },
    "flat.txt": {"extension '.txt', allowed: .dxf, .ifc, .svg, .sh3d, .json": lambda path: unclear(path, "")},
}


@pytest.mark.parametrize(("name", "said"), [(name, said) for name, cases in BAD.items() for said in cases])
def test_what_cannot_be_read_is_one_line(name, said, tmp_path, echousd_command):
    BAD[name][said](tmp_path / name)
    unit = ("--unit", "0.01") if name == "flat.svg" and "scale" not in said else ()
    done = echousd_command("plan", "import", tmp_path / name, "-o", tmp_path / "out.usda", *unit)
    assert done.code == 2, done.out
    assert said in done.err
    assert str(tmp_path / name) in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "out.usda").exists()


def test_files_have_an_end(tmp_path, monkeypatch):
    monkeypatch.setattr("echousd.home.importing.formats.MOST", 100)
    for write, name, unit in PLANS.values():
        write(tmp_path / name)
        with pytest.raises(GraphError, match=r"bytes, allowed: at most 100"):
            read_plan(tmp_path / name, None, unit)


def test_a_plan_comes_in_and_goes_on(tmp_path, echousd_command):
    dxf(tmp_path / "flat.dxf")
    words = ("plan", "import", tmp_path / "flat.dxf", "-o", tmp_path / "flat.usda")
    done = echousd_command(*words, "--picture", tmp_path / "flat.png")
    assert done.code == 0, done.err
    assert "format   dxf: 0.001 m a unit (as the file says), x is east, y north" in done.out
    assert "found    2 rooms, 2 doors, 1 windows, 0 passages, 1 fixed pieces" in done.out
    assert (tmp_path / "flat.png").stat().st_size > 1000
    home = load_home(tmp_path / "flat.usda")
    assert [str(relation) for relation in home.relations] == ["bedroom door hall"]
    plan = plan_there(tmp_path / "flat.usda", home)
    assert plan.area == pytest.approx(17.64, abs=0.3)
    done = echousd_command("plan", "export", tmp_path / "flat.usda", "-o", tmp_path / "again.dxf")
    assert done.code == 0, done.err
    again = imported(read_plan(tmp_path / "again.dxf")[1]).plan
    for name, floor in plan.floors.items():
        np.testing.assert_allclose(again.floors[name], floor, atol=1e-3)
    assert [*map(len, again.openings.values())] == [*map(len, plan.openings.values())]
    assert echousd_command(*words).code == 2, "nothing is overwritten unasked"
    done = echousd_command(*words, "--force", "--unit", "furlong")
    assert "--unit 'furlong', allowed: m, cm, mm, in, ft or metres of one unit" in done.err
    roomplan(tmp_path / "scan.json")
    done = echousd_command("plan", "import", tmp_path / "scan.json", "-o", tmp_path / "s.usda", "--unit", "mm")
    assert "roomplan is always in one unit" in done.err


@pytest.mark.parametrize(
    ("form", "old", "new", "told"),
    [
        ("scenesmith", '"height": 2.0', '"height": 0.001', ""),  # as tall as doors are
        ("scenesmith", '"sill_height": 0.9', '"sill_height": NaN', ""),
        ("procthor", '"y": 2.0', '"y": NaN', ""),
        ("holodeck", "[[4, 1], [4, 1.9]]", "[[4, 1]]", "found no two ends, allowed: x and z of both, finite numbers"),
        ("holodeck", "[[4, 1], [4, 1.9]]", "[[4, 1], [4, NaN]]", "found no two ends"),
        (
            "procthor",
            '{"x": 6, "y": 0, "z": 3}, {"x": 4, "y": 0, "z": 3}',
            '{"x": 4, "y": 0, "z": 3000}',
            "",
        ),
    ],
)
def test_what_a_plan_says_in_vain_is_as_usual_or_told(tmp_path, form, old, new, told):
    write, name, _ = PLANS[form]
    write(tmp_path / name)
    text = (tmp_path / name).read_text()
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new))
    if told:
        with pytest.raises(GraphError, match=rf"{name}: not as json has it \(a hole of array.*\): {told}"):
            import_plan(tmp_path / name)
        return
    plan = import_plan(tmp_path / name).plan
    assert {one.height for own in plan.openings.values() for one in own} <= {2.0, 2.1, 1.3}


def test_a_picture_of_ours_is_no_plan_and_a_path_of_nothing_no_fault(tmp_path, echousd_command):
    svg(tmp_path / "flat.svg")
    text = (tmp_path / "flat.svg").read_text()
    (tmp_path / "flat.svg").write_text(text.replace("</svg>", '<path class="wall"/></svg>'))
    assert len(import_plan(tmp_path / "flat.svg", unit="cm").plan.floors) == 2
    done = echousd_command("plan", tmp_path / "flat.svg", "-o", tmp_path / "flat.usda")
    assert done.code == 2
    words = ("new", tmp_path / "flat.yaml", "--rooms", "hall door bedroom")
    assert echousd_command(*words).code == 0
    assert echousd_command("plan", tmp_path / "flat.yaml", "-o", tmp_path / "drawn.svg").code == 0
    done = echousd_command("plan", "import", tmp_path / "drawn.svg", "-o", tmp_path / "back.usda", "--unit", "1")
    assert "a picture that echousd drew, which has no layers, allowed: the plan as .dxf, .json or .usda" in done.err
