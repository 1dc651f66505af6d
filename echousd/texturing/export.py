"""A room as a job for a texturing tool."""

import json
import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from echomodel.boxes2d import upright
from echomodel.files import telling
from echousd.draw.surfaces import Painted, Surfaces, read_surfaces
from echousd.stage.contents import room_frame, upright_box
from echousd.stage.files import open_stage
from echousd.stage.read import the_room
from echousd.stage.showing import showing_layout
from echousd.stage.values import NOW, reading
from echousd.textures import encoded
from echousd.texturing import scenetex
from echousd.texturing.atlas import Unwrapped, layout_digest, texels, unwrap
from echousd.texturing.job import JOB, RESULTS, TOOLS, Job, script_for
from echousd.texturing.obj import glb_bytes, obj_bytes
from echousd.texturing.viewpoints import SPHERE, free_point, sphere_cameras, visible_shares

RESOLUTION = 2048  # of a picture of one object
IMAGE = 512  # pixels of an object's picture
SCRIPTS = ("hunyuan", "mvpainter")  # tools that paint objects by pictures of them, with a script to run them


def export_texture_job(
    room: str | Path, out: str | Path, tool: str, *, prompt: str = "", dressing: str = "none",
    resolution: int | None = None, layout: int | None = None, shell: bool | None = None, force: bool = False,
) -> Job:  # fmt: skip
    """Write a room as a job for a texturing tool: meshes with texture coordinates, cameras, prompts and `job.json`.

    Arguments:
        room: root layer or folder of a room.
        out: the job's folder.
        tool: `scenetex` (the whole room, one picture of 4096), `hunyuan`, `mvpainter` (object by object, with pictures
            of them) or `generic` (object by object).
        prompt: words for the whole room, "" = from its graph.
        dressing: small things: `none` of them, `grouped` as one object, or `each`.
        resolution: texels along a picture of one object; SceneTex's is 4096.
        layout: number of the layout, None = the one that the room shows.
        shell: floor, walls and ceiling too; None = not for `hunyuan` and `mvpainter`, which paint single pieces.
        force: replace a job that lies there.

    Raises ValueError for another tool, a folder in the way, a room that does not open, and where xatlas (for pictures:
    Embree) is not installed; nothing is written then. The job says in `left_out` what cannot be painted, and why.
    """
    out = Path(out)
    if tool not in TOOLS:
        raise ValueError(f"tool is {tool!r}, allowed: {', '.join(TOOLS)}")
    if resolution is not None and not 64 <= resolution <= 8192:
        raise ValueError(f"resolution is {resolution} texels, allowed: 64 to 8192")
    if tool == "scenetex" and resolution not in (None, scenetex.RESOLUTION):
        raise ValueError(f"resolution is {resolution} texels, allowed for scenetex: {scenetex.RESOLUTION}")
    _check_free(out, force)
    stage = open_stage(room)
    with showing_layout(stage, layout), reading(stage):
        surfaces = read_surfaces(stage, dressing=dressing)
        if not (tool not in SCRIPTS if shell is None else shell):
            surfaces = _without_shell(surfaces)
        job, files = _made(stage, surfaces, tool, prompt, dressing, resolution)
    _write_folder(out, {**files, JOB: (json.dumps(job.model_dump(), indent=1) + "\n").encode()})
    return job


def _without_shell(surfaces: Surfaces) -> Surfaces:
    """What stands in a room, its floor and walls left out; ValueError where nothing stands there."""
    stuff = {thing.name: "floor, wall or ceiling (--shell takes it along)" for thing in surfaces.objects
             if thing.kind == "stuff"}  # fmt: skip
    things = tuple(thing for thing in surfaces.objects if thing.kind == "things")
    if not things:
        raise ValueError("nothing to paint but floor and walls, which --shell takes along")
    return replace(surfaces, objects=things, left_out={**surfaces.left_out, **stuff})


def _made(
    stage: Usd.Stage, surfaces: Surfaces, tool: str, prompt: str, dressing: str, resolution: int | None
) -> tuple[Job, dict[str, bytes]]:
    """The job and its files."""
    together = tool == "scenetex"
    texture = scenetex.RESOLUTION if together else resolution or RESOLUTION
    frames = {thing.name: np.eye(4) if together else _frame(stage, thing) for thing in surfaces.objects}
    meshes = [[(_moved(p.world, frames[thing.name]), p.vertices) for p in thing.pieces] for thing in surfaces.objects]
    laid = unwrap(meshes, texture, together=together)
    kept, left = _whole(surfaces, laid)
    objects, laid = [surfaces.objects[number] for number in kept], [laid[number] for number in kept]
    if not objects:
        raise ValueError(f"nothing to paint; {'; '.join(f'{name}: {why}' for name, why in left.items())}")
    at, space = free_point(surfaces)
    distance = min(SPHERE, max(space - 0.05, 0.05))
    around = sphere_cameras(at, distance)
    shares = visible_shares(objects, laid, around)
    named = dict.fromkeys(node.style for node in surfaces.graph.nodes if node.style)  # the styles of the graph
    words = prompt or _prompt(surfaces.graph.room.type or "room", list(named), surfaces.palette)
    every = [_prompt(one.category or one.name, [one.style or ""], surfaces.palette) for one in objects]
    files: dict[str, bytes] = {}
    name = Path(stage.GetRootLayer().realPath or "room").stem
    if together:
        files |= scenetex.scenetex_files(name, words, every, objects, laid, at, distance)
    entries = []
    for number, (thing, mesh) in enumerate(zip(objects, laid, strict=True)):
        path = scenetex.mesh_path(number, thing, name) if together else f"meshes/{thing.name}.obj"
        files[path] = obj_bytes(mesh, thing.name)
        image = ""
        if tool in SCRIPTS:
            image = f"imgs/{thing.name}.png"
            files[f"glbs/{thing.name}.glb"], files[image] = glb_bytes(mesh, thing.name), _picture(stage, thing)
        covered = int(texels(mesh.corners, texture))
        entries.append({
            "name": thing.name, "path": thing.path, "kind": thing.kind, "category": thing.category,
            "style": thing.style, "prompt": every[number], "mesh": path, "image": image,
            "triangles": len(mesh.faces), "topology": thing.topology, "layout": layout_digest(mesh.corners),
            "texels": covered, "visible": None if shares is None else int(shares[number] * covered),
            "to_room": np.linalg.inv(frames[thing.name]).round(6).tolist(),
        })  # fmt: skip
    if tool in SCRIPTS:
        files["run.sh"] = script_for(tool)
    files[f"{RESULTS}/README.txt"] = _expected(tool).encode()
    job = Job.model_validate({
        "tool": tool, "room": name, "palette": surfaces.palette, "prompt": words, "resolution": texture,
        "one_picture": together, "dressing": dressing, "cameras": around, "objects": entries, "left_out": left,
    })  # fmt: skip
    return job, files


def _whole(surfaces: Surfaces, laid: Sequence[Unwrapped]) -> tuple[list[int], dict[str, str]]:
    """Numbers of the objects that can be painted, and why others cannot.

    A polygon whose triangles were cut apart has two texture coordinates at one corner, which no primvar can hold.
    """
    kept, left = [], dict(surfaces.left_out)
    for number, (thing, mesh) in enumerate(zip(surfaces.objects, laid, strict=True)):
        start = cut = 0
        for piece in thing.pieces:
            st = mesh.corners[start : start + len(piece.corners)].reshape(-1, 2)
            start += len(piece.corners)
            corner = piece.corners.reshape(-1)
            first = np.zeros((piece.size, 2))
            first[corner[::-1]] = st[::-1]
            cut += int((np.abs(first[corner] - st).max(1) > 1e-6).any())
        if cut:
            left[thing.name] = "has polygons that a seam cuts, triangulate its meshes"
        else:
            kept.append(number)
    return kept, left


def _frame(stage: Usd.Stage, thing: Painted) -> np.ndarray:
    """(4, 4) float, the room to the object's frame: its box's bottom centre, its front along +Z."""
    own = np.eye(3)
    if thing.kind == "things":
        room, cache = the_room(stage, None).room, UsdGeom.XformCache(NOW)
        world = np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(thing.path))).T
        own = (room_frame(room, cache) @ world)[:3, :3]
    _, bottom, yaw = upright_box(thing.triangles.reshape(-1, 3), own)
    out = np.eye(4)
    out[:3, :3] = upright(-yaw)
    out[:3, 3] = -out[:3, :3] @ bottom
    return out


def _moved(triangles: np.ndarray, frame: np.ndarray) -> np.ndarray:
    return np.asarray(triangles @ frame[:3, :3].T + frame[:3, 3])


def _picture(stage: Usd.Stage, thing: Painted) -> bytes:
    """PNG of the object alone, as it looks now."""
    from echousd.draw.rendering import render_stage

    mask = Usd.StagePopulationMask([thing.path])
    alone = Usd.Stage.OpenMasked(stage.GetRootLayer(), stage.GetSessionLayer(), mask)
    alone.ExpandPopulationMask()
    for prim in alone.GetPrimAtPath(thing.path).GetParent().GetAllChildren():
        if str(prim.GetPath()) != thing.path:
            prim.SetActive(False)
    return encoded(render_stage(alone, size=IMAGE, rays=1))


def _expected(tool: str) -> str:
    """What belongs into the folder of results."""
    one = "scene.png, one picture of 4096 x 4096 (what is found below outputs/ will do, the highest step)"
    many = (
        "<object>.glb with the same triangles, its own texture coordinates and one base colour image; or <object>.png "
        "(.jpg) laid out as meshes/<object>.obj is, and <object>_metal_rough.png (roughness in green, metal in blue), "
        "<object>_normal.png if there are any; or <object>.obj beside them with other texture coordinates. Objects "
        "without a result keep their look."
    )
    return (one if tool == "scenetex" else many) + "\n"


def _check_free(out: Path, force: bool) -> None:
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out}: is a file, the job must be a folder")
    if out.is_dir() and any(out.iterdir()):
        ours = (out / JOB).is_file()
        if not (ours and force):
            more = "use --force to replace it, results included" if ours else "choose another folder"
            raise ValueError(f"{out}: holds {'a job' if ours else 'other things'} already; {more}")


def _write_folder(out: Path, files: dict[str, bytes]) -> None:
    """The folder appears whole; raises ValueError where it cannot be written."""
    with telling(out, then="; nothing was changed"):
        out.parent.mkdir(parents=True, exist_ok=True)
        beside = Path(tempfile.mkdtemp(prefix=f".{out.name}.", dir=out.parent))
        try:
            for path, content in files.items():
                place = beside / path
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(content)
                if place.suffix == ".sh":
                    place.chmod(0o755)
            mask = os.umask(0)
            os.umask(mask)
            beside.chmod(0o777 & ~mask)
            if out.is_dir():
                shutil.rmtree(out)
            beside.replace(out)
        finally:
            shutil.rmtree(beside, ignore_errors=True)


def _prompt(name: str, styles: list[str], palette: str) -> str:
    """`a bedroom in oak style, coast colours`: a room or an object, its styles and the room's palette."""
    kind, styled = _words(name), list(dict.fromkeys(map(_words, filter(None, styles))))
    prompt = f"{'an' if kind[:1] in 'aeiou' else 'a'} {kind}"
    prompt += f" in {' and '.join(styled[:3])} style" if styled else ""
    return prompt + (f", {_words(palette)} colours" if palette else "")


def _words(name: str) -> str:
    """A name of the graph as words that are safe in a file's name and in a shell."""
    return " ".join("".join(c if c.isalnum() else " " for c in name).split())[:60]
