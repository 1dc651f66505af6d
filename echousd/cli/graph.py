"""`echousd new` writes a scene graph, `echousd graph` shows one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from echomodel.files import check_free
from echomodel.late import Late
from echousd.cli.options import AsJson, Replace, ReplacePicture
from echousd.cli.output import check_picture, counted, say, say_done, say_json
from echousd.naming import STAGE_FORMS

if TYPE_CHECKING:
    from echousd.graph import SceneGraph
    from echousd.home.graph import HomeGraph

load_home, vocabulary = Late("echousd.home.files:load_home"), Late("echomodel.vocabulary:vocabulary")
app = typer.Typer()

NEW_EXAMPLES = """Examples:

    echousd new bedroom.usda --from samples/bedroom.yaml

    echousd new bedroom.usda --room bedroom --count nightstand=2 --count desk=1 --size 4 3.5

    echousd new bedroom.usda --room bedroom --size 4 3.5 --door 'south 0.3' --window 'north 1.2 1.6'

    echousd new bedroom.yaml --room bedroom     (a text to edit by hand)

    echousd new flat.usda --rooms "kitchen open_to living, hall door bedroom*2, hall door bathroom" --area 75

Frames: the room's front is +X, its right +Z, up +Y; lengths are metres, yaw is radians about +Y or, as in 90 deg,
degrees; at yaw 0 the front of an object looks along +Z."""

GRAPH_EXAMPLES = """Examples:

    echousd graph bedroom.usda

    echousd graph bedroom.usda -o bedroom.png

    echousd graph house.usda --room /House/Bedroom --json > bedroom.json

    echousd graph scan.usdc --names --relations 2 > room.yaml

    echousd graph --schema > scenegraph.schema.json"""


def _room_types(incomplete: str) -> list[str]:
    return [kind.name for kind in vocabulary().room_types if kind.name.startswith(incomplete)]


def _counts(incomplete: str) -> list[str]:
    return [f"{entry.name}=" for entry in vocabulary().categories if entry.name.startswith(incomplete)]


@app.command("new", epilog=NEW_EXAMPLES)
def new(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="File to write: .usda, .usdc, .usd, .yaml or .json.")],
    source: Annotated[
        Path | None, typer.Option("--from", metavar="GRAPH", help="YAML, JSON or stage to take the graph of.")
    ] = None,
    room: Annotated[
        str | None,
        typer.Option(
            "--room", autocompletion=_room_types, help="Room type: begin with what such a room usually holds."
        ),
    ] = None,
    count: Annotated[
        list[str] | None,
        typer.Option(metavar="CATEGORY=N", autocompletion=_counts, help="Objects of a category; 0 leaves it out."),
    ] = None,
    rooms: Annotated[
        str | None,
        typer.Option(
            metavar="'A PREDICATE B, ...'",
            help="A home: its rooms and how they lie (door, open_to, adjacent, north_of, larger_than ...).",
        ),
    ] = None,
    area: Annotated[float | None, typer.Option(metavar="M2", help="Of a home: all its floors, square metres.")] = None,
    relate: Annotated[
        list[str] | None,
        typer.Option(metavar="'A PREDICATE B'", help="One more relation, such as 'desk left of double_bed'."),
    ] = None,
    size: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="X Z", help="Extents of the floor, metres; of a home, of its outer walls."),
    ] = None,
    height: Annotated[float | None, typer.Option(metavar="M", help="Height of the room, metres.")] = None,
    door: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WALL ...",
            help="A door: wall, metres from its first corner, width, hinge=, swing=, height=, name=.",
        ),
    ] = None,
    window: Annotated[
        list[str] | None,
        typer.Option(metavar="WALL ...", help="A window: wall, metres from its first corner, width, sill=, height=."),
    ] = None,
    force: Replace = False,
    json: AsJson = False,
) -> None:
    """Author a scene graph, as a stage or as text, from a file or from a room type."""
    from echousd.graph import GraphError, RoomSpec, load_graph, save_graph, starting_graph
    from echousd.graph.nodes import Placed
    from echousd.graph.text import sentence, stating, with_openings

    if sum(fields is not None for fields in (source, room, rooms)) != 1:
        raise GraphError("say where the graph comes from: either --from GRAPH, --room TYPE or --rooms ROOMS")
    if room is None and count:
        raise GraphError("--count goes with --room; edit the objects of a file in the file")
    check_free(out, force=force)
    home = None if room else home_from(source, rooms, area, size, relate or ())
    if home is not None:
        if height or door or window:
            raise GraphError("--height, --door and --window are of one room; write those of a home's into its file")
        from echousd.home.files import save_home

        save_home(home, out)
        on = "" if home.area is None else f" on {home.area:g} m²"
        line = f"wrote {out}: a home of {len(home.rooms)} rooms{on}, {len(home.relations)} relations between them"
        say_done(json, [out], [line], {"rooms": len(home.rooms), "relations": len(home.relations)})
        return
    if area is not None:
        raise GraphError("--area goes with --rooms; the floor of one room is --size")
    fields = {name: value for name, value in {"size": size, "height": height}.items() if value is not None}
    if source is not None:
        made = load_graph(source).with_room(**fields)
        later = relate or ()
    else:
        assert room is not None
        sentences = {text: sentence(text) for text in relate or ()}
        stated = [one for one in sentences.values() if not isinstance(one, Placed)]
        later = [text for text, one in sentences.items() if isinstance(one, Placed)]
        made = starting_graph(RoomSpec(room, **fields), dict(map(_counted, count or ())), stated)
    for text in later:
        made = stating(made, text)
    words = [("door", text) for text in door or ()] + [("window", text) for text in window or ()]
    if words:
        made = made.replaced(room=with_openings(made.room, words))
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise GraphError(f"{out.parent}: cannot be made ({(error.strerror or str(error)).lower()})") from None
    save_graph(made, out)
    counts = {"objects": len(made.nodes), "relations": len(made.relations), "placements": len(made.placements)}
    say_done(json, [out], [f"wrote {out}: {_summary(made)}"], counts)


def home_from(
    source: Path | None, rooms: str | None, area: float | None, size: tuple[float, float] | None, relate: Sequence[str]
) -> HomeGraph | None:
    """The home that a command line describes, None where its file holds a single room."""
    from echousd.home.graph import HomeGraph as Home

    about: dict[str, Any] = {} if area is None else {"area": area}
    if size is not None:
        about["outline"] = ((0.0, 0.0), (size[0], 0.0), size, (0.0, size[1]))
    if rooms is not None:
        home = Home.from_words(rooms, **about)
    else:
        found = load_home(source) if source is not None and source.is_file() else None
        if found is None:
            return None
        home = found.replaced(**about)
    for sentence in relate:
        home = home.relate(sentence)
    return home


def _counted(text: str) -> tuple[str, int]:
    word, _, number = text.partition("=")
    if not number.strip().isdecimal():
        raise ValueError(f"--count {text}: allowed: a category and a number, such as nightstand=2")
    return word, int(number)


@app.command("graph", epilog=GRAPH_EXAMPLES)
def graph(
    source: Annotated[
        Path | None, typer.Argument(metavar="GRAPH", help="Stage (.usda .usdc .usd .usdz), YAML, JSON, or a room.")
    ] = None,
    room: Annotated[str | None, typer.Option(metavar="PRIM", help="Prim path of one room of several.")] = None,
    names: Annotated[
        bool, typer.Option("--names", help="Of a stage without a graph: names of prims count where labels are missing.")
    ] = False,
    relations: Annotated[
        float | None,
        typer.Option(
            metavar="N", help="Add N relations an object from the boxes, near and meaningful ones first.", min=0
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the canonical JSON form.")] = False,
    picture: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Draw a picture (.png, .svg, .pdf).")
    ] = None,
    force: ReplacePicture = False,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of the canonical form; needs no GRAPH.")
    ] = False,
) -> None:
    """Show the scene graph of a stage or a text file, as the text that a person writes."""
    from echousd.folder.found import room_at
    from echousd.graph import GraphError, SceneGraph, load_graph
    from echousd.graph.picture import PICTURES, draw_graph

    if as_json and schema:
        raise GraphError("--json and --schema exclude each other")
    if schema:
        say_json(SceneGraph.model_json_schema(), indent=2)
        return
    if source is None:
        raise GraphError("GRAPH is missing, allowed: a stage, a YAML or a JSON file, or a room's folder")
    source = room_at(source)
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise GraphError(f"{picture}: extension {picture.suffix!r}, allowed: {', '.join(PICTURES)}")
    alone = room is not None or as_json or picture is not None
    stage = source.suffix.lower() in STAGE_FORMS
    home = None if stage else load_home(source)
    if home and not (room or picture or relations is not None):
        typer.echo(home.to_json() if as_json else home.to_yaml(), nl=False)
        return
    if home or (stage and (names or not alone)):
        shown = {each.name: each.graph for each in home.rooms} if home else _rooms(source, names=names)
        if room is not None and room not in shown:
            raise GraphError(f"{source}: no room {room!r}, allowed: {', '.join(filter(None, shown)) or 'none'}")
        shown = shown if room is None else {"": shown[room]}
        if len(shown) > 1 and alone:
            raise GraphError(f"{source}: {len(shown)} rooms, say which one of {', '.join(shown)} (--room)")
    else:
        shown = {"": load_graph(source, room)}
    if relations is not None:
        from echousd.stage.boxes import relations_from_boxes

        shown = {prim: relations_from_boxes(each, per_object=relations) for prim, each in shown.items()}
    only = next(iter(shown.values()))
    if picture is not None:
        check_picture(picture, force=force)
        draw_graph(only, picture)
        say(f"wrote {picture}: {_summary(only)}", err=True)
    if as_json:
        typer.echo(only.to_json(), nl=False)
    elif picture is None:
        for number, (prim, each) in enumerate(shown.items()):
            heading = f"# {prim} {_summary(each)}" if prim else f"# {_summary(each)}"
            typer.echo(f"{'---' if number else ''}\n{heading}\n{each.to_yaml()}".lstrip("\n"), nl=False)


def _rooms(source: Path, *, names: bool) -> dict[str, SceneGraph]:
    """All rooms of a stage by prim path; a single one goes without."""
    from echousd.stage.files import open_stage
    from echousd.stage.foreign import foreign_rooms
    from echousd.stage.read import read_rooms

    stage = open_stage(source)
    rooms = read_rooms(stage) or foreign_rooms(stage, names=names)
    return rooms if len(rooms) > 1 else {"": next(iter(rooms.values()))}


def _summary(made: SceneGraph) -> str:
    objects, relations = counted(len(made.nodes), "object"), counted(len(made.relations), "relation")
    return f"{made.room.type.replace('_', ' ')}, {objects}, {relations}"
