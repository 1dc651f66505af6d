"""`echousd new` writes a scene graph, `echousd graph` shows one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from echomodel.files import check_free, telling
from echomodel.late import Late
from echousd.cli.options import AsJson, Replace, ReplacePicture, documented_command
from echousd.cli.output import check_picture, counted, say, say_done, say_json
from echousd.naming import STAGE_FORMS

if TYPE_CHECKING:
    from echousd.graph import SceneGraph
    from echousd.home.graph import HomeGraph

load_home, vocabulary = Late("echousd.home.files:load_home"), Late("echomodel.vocabulary:vocabulary")
app = typer.Typer()


@documented_command(app, "new")
def new(
    out: Path, source: Path | None = None, room: str | None = None, count: list[str] | None = None,
    rooms: str | None = None, area: float | None = None, relate: list[str] | None = None,
    size: tuple[float, float] | None = None, height: float | None = None, door: list[str] | None = None,
    window: list[str] | None = None, force: Replace = False, json: AsJson = False,
) -> None:  # fmt: skip
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
    with telling(out.parent, "cannot be made"):
        out.parent.mkdir(parents=True, exist_ok=True)
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


@documented_command(app, "graph")
def graph(
    source: Path | None = None, room: str | None = None, names: bool = False, relations: float | None = None,
    as_json: bool = False, picture: Path | None = None, force: ReplacePicture = False, schema: bool = False,
) -> None:  # fmt: skip
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
