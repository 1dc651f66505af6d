"""`echousd edit`: change the graph of a room, make anew only what the change touches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from echousd.cli.output import say


def register(app: typer.Typer) -> None:
    """Add the command."""

    @app.command(
        epilog='Example: echousd edit out/bedroom/bedroom.usda --add stool:stool --relate "stool close by bed"'
    )
    def edit(
        room: Annotated[Path, typer.Argument(help="Root layer of a room that generate made.", show_default=False)],
        add: Annotated[list[str] | None, typer.Option(help="Object to add, as name:category.")] = None,
        remove: Annotated[list[str] | None, typer.Option(help="Object to remove.")] = None,
        relabel: Annotated[list[str] | None, typer.Option(help="Other category, as name:category.")] = None,
        relate: Annotated[list[str] | None, typer.Option(help='Relation to add: "stool close by bed".')] = None,
        unrelate: Annotated[list[str] | None, typer.Option(help="Relation to take out.")] = None,
        output: Annotated[Path | None, typer.Option("-o", "--output", help="Other folder; default: in place.")] = None,
        seed: Annotated[int, typer.Option(help="Seed of the new randomness, 0 to 2^63 - 1.")] = 0,
        shapes: Annotated[
            str | None, typer.Option(help="Of new objects: parts, sdf or boxes; default: what the room is made of.")
        ] = None,
        weights: Annotated[Path | None, typer.Option(help="Weights file or folder; default: those that ship.")] = None,
        repair: Annotated[
            bool, typer.Option("--repair/--no-repair", help="Move and size new boxes until the graph is kept.")
        ] = True,
        force: Annotated[bool, typer.Option("--force", help="Write into a folder that is not ours.")] = False,
        wait: Annotated[bool, typer.Option("--wait", help="Wait for another process that writes the folder.")] = False,
    ) -> None:
        """Change what a room holds; objects that the change does not touch stay byte for byte."""
        from echousd.cli.generate import check_output, end, progress_bar, report, telling_faults, writing
        from echousd.graph.text import relation_from_text
        from echousd.room.edit import edit as change
        from echousd.room.reading import read_room
        from echousd.room.save import save_layers, write_preview, write_sheet

        folder = output or room.parent
        check_output(folder, flat=False, force=force)
        with writing(folder, flat=False, force=force, wait=wait):
            old = graph = read_room(room).graph
            for name in remove or ():
                graph = graph.remove_node(name)
            for text in unrelate or ():
                gone = relation_from_text(text)
                graph = graph.unrelate(gone.subject, gone.predicate, gone.object)
            for text in relabel or ():
                graph = graph.relabel_node(*_named(text))
            for text in add or ():
                graph = graph.add_node(*_named(text))
            for text in relate or ():
                new = relation_from_text(text)
                graph = graph.relate(new.subject, new.predicate, new.object)
            steps = old.diff(graph).lines()
            if not steps:
                raise ValueError("nothing to change; use --add, --remove, --relabel, --relate or --unrelate")
            with telling_faults(), progress_bar() as listen:
                made = change(
                    room, graph, seed=seed, shapes=shapes, model=weights, repair=repair, progress=listen,
                )  # fmt: skip
                listen("write", 0, 1)
                root = save_layers(made, folder, force=force)
                listen("write", 1, 1)
                preview = write_preview(root)
                preview = write_sheet(root) or preview
        for step in steps:
            say(step)
        report(made, root, preview)
        end([(made, root, preview)])


def _named(text: str) -> tuple[str, str]:
    name, _, category = text.partition(":")
    return name, category or name
