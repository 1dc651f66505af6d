"""`echousd data meshes` and `echousd data sheet`: sets of real furniture, and pictures of furniture in a grid."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    import trimesh

    from echomodel.data.catalogues import MeshEntry

PACKAGE = "sweethome3d-furniture"
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
    from rich.console import Console
    from rich.progress import Progress

    from echomodel.data.meshes import build_meshes, draft_table, read_table, write_table

    console = Console(stderr=True, highlight=False)
    out.mkdir(parents=True, exist_ok=True)
    paths = list(sources or [])
    if debian:
        paths.append(_fetch(out))
    if not paths:
        raise ValueError("no source given: name libraries or folders, or use --debian")
    entries = [entry for path in paths for entry in _entries(path, out)]
    table = out / "table.csv"
    if not table.exists():
        write_table(table, draft_table(entries))
    rows = read_table(table)
    used = sum(row.use for row in rows)
    console.print(f"{table}: {len(rows)} models, {used} of them used")
    if table_only:
        return
    loaders = dict.fromkeys(USD_FILES, _read_usd)
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
    from echomodel.data.furniture import mesh_of
    from echomodel.data.shapeset import ShapeSet, piece
    from echomodel.data.sheet import contact_sheet
    from echomodel.data.tsdf import mesh_from_tsdf
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
    contact_sheet(rows, pixels).save(out)


def _fetch(out: Path) -> Path:
    """Download the Debian package into OUT/source; raises ValueError where apt is missing or fails."""
    folder = out / "source"
    folder.mkdir(exist_ok=True)
    have = sorted(folder.glob(f"{PACKAGE}_*.deb"))
    if have:
        return have[-1]
    if shutil.which("apt-get") is None:
        raise ValueError(f"--debian needs apt-get; elsewhere download {PACKAGE}_1.8-1_all.deb and name it as a source")
    done = subprocess.run(["apt-get", "download", PACKAGE], cwd=folder, capture_output=True, text=True, check=False)
    found = sorted(folder.glob(f"{PACKAGE}_*.deb"))
    if done.returncode or not found:
        raise ValueError(f"apt-get download {PACKAGE} failed: {(done.stderr.strip() or 'no file').splitlines()[-1]}")
    return found[-1]


def _entries(path: Path, out: Path) -> list[MeshEntry]:
    """Models of one source: a library, a package of libraries, or a folder."""
    from echomodel.data.catalogues import MESH_FILES, read_folder, read_library

    if not path.exists():
        raise ValueError(f"{path}: no such file or folder")
    if path.suffix == ".sh3f":
        return read_library(path)
    if path.suffix == ".deb":
        if shutil.which("dpkg") is None:
            raise ValueError(f"{path}: unpacking a Debian package needs dpkg; unpack it and name the .sh3f files")
        unpacked = out / "source" / path.stem
        if not unpacked.exists():
            unpacked.parent.mkdir(parents=True, exist_ok=True)
            done = subprocess.run(["dpkg", "-x", str(path), str(unpacked)], capture_output=True, text=True, check=False)
            if done.returncode:
                reason = (done.stderr.strip() or "no reason given").splitlines()[-1]
                raise ValueError(f"{path}: dpkg cannot unpack it ({reason})")
        path = unpacked
    if not path.is_dir():
        raise ValueError(f"{path}: not a .sh3f library, a .deb package or a folder")
    libraries = sorted(path.rglob("*.sh3f"))
    found = [entry for library in libraries for entry in read_library(library)]
    found = found or read_folder(path, (*MESH_FILES, *USD_FILES))
    if not found:
        raise ValueError(f"{path}: holds neither .sh3f libraries nor {', '.join((*MESH_FILES, *USD_FILES))} files")
    return found


def _read_usd(path: Path) -> trimesh.Trimesh:
    """All meshes of a stage as triangles, in metres, +Y up; raises ValueError where there are none."""
    import numpy as np
    import trimesh
    from pxr import Usd, UsdGeom

    from echousd.stage.units import metres_per_unit, up_axis

    stage = Usd.Stage.Open(str(path))
    cache = UsdGeom.XformCache()
    parts = []
    for prim in Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Mesh) or UsdGeom.Imageable(prim).ComputeVisibility() == UsdGeom.Tokens.invisible:
            continue
        mesh = UsdGeom.Mesh(prim)
        points = np.asarray(mesh.GetPointsAttr().Get() or [], float).reshape(-1, 3)
        counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get() or [], int)
        indices = np.asarray(mesh.GetFaceVertexIndicesAttr().Get() or [], int)
        if len(points) == 0 or len(counts) == 0:
            continue
        matrix = np.array(cache.GetLocalToWorldTransform(prim))
        world = np.c_[points, np.ones(len(points))] @ matrix
        starts = np.cumsum(counts) - counts
        fans = [
            np.stack(
                [indices[starts[counts > k]], indices[starts[counts > k] + k - 1], indices[starts[counts > k] + k]], 1
            )
            for k in range(2, counts.max())
        ]
        parts.append(trimesh.Trimesh(world[:, :3], np.concatenate(fans), process=False))
    if not parts:
        raise ValueError("the stage holds no visible Mesh prims")
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=False)])
    vertices = np.concatenate([part.vertices for part in parts]) * metres_per_unit(stage)
    if up_axis(stage) == UsdGeom.Tokens.z:
        vertices = vertices[:, [0, 2, 1]] * [1, 1, -1]
    return trimesh.Trimesh(vertices, faces, process=False)
