"""`echousd data meshes` and `echousd data sheet`: sets of real furniture, and pictures of furniture in a grid."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from echomodel.files import write_picture

if TYPE_CHECKING:
    import trimesh


PACKAGE = "sweethome3d-furniture"  # as `echomodel.data.meshes` has it, which need not be loaded for --help
USD_FILES = (".usd", ".usda", ".usdc", ".usdz")


def register(app: typer.Typer) -> None:
    """Add the commands to `echousd data`."""
    from echousd.cli.data import data_app

    data_app.command("meshes")(meshes)
    data_app.command("sheet")(sheet)


def meshes(
    sources: Annotated[
        list[Path] | None, typer.Argument(help="Libraries (.sh3f), a .deb that holds them, folders of OBJ, GLB or USD.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the set.")] = Path("meshes"),
    debian: Annotated[bool, typer.Option(help=f"Fetch the Debian package {PACKAGE} with apt.")] = False,
    table_only: Annotated[bool, typer.Option(help="Write OUT/table.csv for review and stop.")] = False,
    copies: Annotated[int, typer.Option(min=1, help="Stored shapes per training mesh: 1 as it is, 2 with mirror.")] = 2,
) -> None:
    """Make a shape set from real meshes: classes by name, metric size, flood-filled distances, thumbnails, attribution.

    OUT/table.csv is written first and read again when it exists: correct `class`, `use` and `yaw` there and run again.

    Example: echousd data meshes --debian -o data/meshes
    """
    from rich.progress import Progress

    from echomodel.data.meshes import build_meshes, draft_table, entries_of, fetched_package, read_table, write_table
    from echousd.cli.terminal import Terminal
    from echousd.stage.meshes import stage_mesh

    console = Terminal(stderr=True)
    out.mkdir(parents=True, exist_ok=True)
    paths = list(sources or [])
    if debian:
        paths.append(fetched_package(out))
    if not paths:
        raise ValueError("no source given: name libraries or folders, or use --debian")
    entries = [entry for path in paths for entry in entries_of(path, out, USD_FILES)]
    table = out / "table.csv"
    if not table.exists():
        write_table(table, draft_table(entries))
    rows = read_table(table)
    used = sum(row.use for row in rows)
    console.print(f"{table}: {len(rows)} models, {used} of them used")
    if table_only:
        return
    loaders = dict.fromkeys(USD_FILES, stage_mesh)
    with Progress(console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("meshes", total=used)

        def progress(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)
            if not console.is_terminal and done % 50 == 0:
                console.print(f"meshes {done}/{total}")

        shapes = build_meshes(
            out, entries, rows, copies=copies, loaders=loaders, progress=progress,
            skipped=lambda line: console.print(f"skipped: {line}"),
        )  # fmt: skip
    console.print(f"{out}: {len(shapes)} shapes, {int(shapes.held_out.sum())} held out")


def sheet(
    out: Annotated[Path, typer.Option("--out", "-o", help="Picture file.")],
    categories: Annotated[list[str] | None, typer.Argument(help="Categories; default all.")] = None,
    count: Annotated[int, typer.Option(help="Samples per category.")] = 12,
    seed: Annotated[int, typer.Option(help="Seed of the world.")] = 0,
    shapes: Annotated[Path | None, typer.Option("--set", help="Draw the shapes of this set instead.")] = None,
    pixels: Annotated[int, typer.Option(help="Side of one picture.")] = 120,
) -> None:
    """Draw samples of every category in a grid: parametric pieces of styles 0, 1, ... or the shapes of a set.

    Example: echousd data sheet chair dining_table -o chairs.png
    """
    from echomodel.data.shapeset import ShapeSet, piece
    from echomodel.data.sheet import contact_sheet
    from echomodel.furniture import mesh_of
    from echomodel.tsdf import mesh_from_tsdf
    from echomodel.vocabulary import vocabulary

    words = vocabulary()
    names = [words.category(word).name for word in categories] if categories else [c.name for c in words.categories]
    rows: list[tuple[str, list[trimesh.Trimesh]]] = []
    stored = ShapeSet(shapes) if shapes else None
    for name in names:
        if stored is None:
            pieces = [piece(seed, style, name) for style in range(count)]
            rows.append((name, [mesh_of(parts, size) for _, size, parts in pieces]))
            continue
        found = [i for i in range(len(stored)) if stored.category[i] == words.category_id(name)][:count]
        drawn = [mesh_from_tsdf(stored[i]) for i in found]
        for mesh, i in zip(drawn, found, strict=True):
            mesh.apply_scale(stored.size[i])
        if drawn:
            rows.append((f"{name} ({len(drawn)})", drawn))
    write_picture(out, contact_sheet(rows, pixels))
