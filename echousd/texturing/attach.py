"""A painted job brought back into its room: files checked, then written as one step."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, Vt

import echousd
from echomodel.files import check_free
from echousd.draw.surfaces import Painted, Surfaces, read_surfaces
from echousd.folder import folder as folders
from echousd.folder import ownership
from echousd.folder.found import room_at
from echousd.folder.manifest import find_manifest
from echousd.folder.merging import loses_text
from echousd.graph.values import IDENTIFIER
from echousd.layers import paintings
from echousd.layers.paintings import FOLDER, MADE, RECORD, VARIANTS, primvar
from echousd.make.save import write_preview
from echousd.naming import LAYER_FORMS
from echousd.stage.files import layer_bytes, open_stage, prim_specs
from echousd.stage.paths import UNFIT
from echousd.stage.pen import Pen
from echousd.stage.shading import Image, preview_surface
from echousd.stage.units import set_units
from echousd.stage.values import reading
from echousd.texturing.job import Job, read_job
from echousd.texturing.results import Results, read_results


@dataclass(frozen=True)
class ImportedLook:
    """What an import did.

    Arguments:
        name: of the look, a variant of `looks` on the room. layer: its file.
        painted: names of the objects that have a picture now. unpainted: those of the job without a result.
        skipped: those that were left out as asked.
    """

    name: str
    layer: Path
    painted: tuple[str, ...]
    unpainted: tuple[str, ...]
    skipped: tuple[str, ...]


def import_texture_job(
    room: str | Path, job: str | Path, *, name: str = "", skip: tuple[str, ...] = (), preview: bool = True,
    force: bool = False, wait: bool = False,
) -> ImportedLook:  # fmt: skip
    """Bring what a texturing tool made of a job back as a look of the room.

    Written are `looks/<name>.usda`, the room's strongest sublayer from then on, and beside it the pictures and the
    texture coordinates `st_<name>`; the variant set `looks` on the room has `made` (as it was) and `<name>`.

    Arguments:
        room: root layer or folder of the room that the job was made of. job: the job's folder.
        name: of the look, "" = the tool's.
        skip: names of objects that keep their look.
        preview: draw the room's picture anew.
        force: replace a look of that name.
        wait: for another process that writes the folder, else raise.

    Raises ValueError, nothing written, for results that are missing or cannot be used, for a name that is taken, and
    for objects that are not what they were when the job was made, by their names.
    """
    room, folder = room_at(Path(room)), Path(job)
    if room.suffix not in LAYER_FORMS:
        raise ValueError(f"{room}: allowed: a room's root layer, {', '.join(LAYER_FORMS)}")
    task = read_job(folder)
    name = name or task.tool
    if not IDENTIFIER.fullmatch(name) or len(name) > paintings.LONGEST or name == paintings.MADE:
        raise ValueError(
            f"name is {name!r:.80}, allowed: letters, digits and _, not beginning with a digit, not {paintings.MADE!r}"
        )
    top = room.parent
    run = f"import {folders.digest(repr((folder.absolute(), task, name, skip)).encode())}"
    with folders.held(top, wait=wait, run=run) as finished:
        layer = f"{paintings.FOLDER}/{name}.usda"
        force = force or finished == run
        check_free(top / layer, force=force, other="--name")
        stage = open_stage(room)
        with reading(stage):
            surfaces = read_surfaces(stage, dressing=task.dressing)
            _compare(task, surfaces, skip, folder)
            objects, pictures = read_results(folder, task)
            for word in skip:
                objects.pop(word, None)
            if not objects:
                raise ValueError(f"{folder}: every object with a result is left out (--skip); nothing to import")
            files = look_files(stage, surfaces, (objects, pictures), name, task.tool, task.dressing)
        for path in (path for path in files if ownership.read(top, path) != files[path]):
            check_free(top / path, force=force, other="--name")
        shared = {path for thing in surfaces.objects for piece in thing.pieces for path in piece.instances}
        files |= _attached(room, layer, shared)
        order = [f"{paintings.FOLDER}/{name}/st.usdc", layer, UNFIT, room.name, f"{room.stem}.json"]
        drawn = ownership.pictures(top, room.stem)
        changed = folders.write_together(top, files, last=[path for path in order if path in files], remove=drawn)
        for loaded in filter(None, (Sdf.Layer.Find(str(top / path)) for path in changed)):
            loaded.Reload()  # this process holds it open, as it was before
        if preview and find_manifest(top, room.stem):
            write_preview(room)
    names = [thing.name for thing in task.objects]
    painted = tuple(word for word in names if word in objects)
    unpainted = tuple(word for word in names if word not in objects and word not in skip)
    return ImportedLook(name, top / layer, painted, unpainted, tuple(skip))


def _compare(job: Job, surfaces: Surfaces, skip: tuple[str, ...], folder: Path) -> None:
    """Raises ValueError that names every object of the job in `folder` that the room does not hold as it was."""
    names = {thing.name for thing in job.objects}
    unknown = [word for word in skip if word not in names]
    if unknown:
        raise ValueError(f"--skip names {', '.join(unknown)}, allowed: {', '.join(sorted(names))}")
    now = {thing.name: thing for thing in surfaces.objects}
    gone = [thing.name for thing in job.objects if thing.name not in now and thing.name not in skip]
    changed = [
        thing.name
        for thing in job.objects
        if thing.name in now
        and thing.name not in skip
        and (now[thing.name].topology != thing.topology or now[thing.name].path != thing.path)
    ]
    why = [f"{', '.join(words)} {what}" for words, what in ((gone, "is gone"), (changed, "has other meshes")) if words]
    if why:
        raise ValueError(
            f"{folder}: not the room that the job was made of: {' and '.join(why)}; export again, or leave out with "
            "--skip"
        )


def _attached(room: Path, layer: str, shared: set[str]) -> dict[str, bytes]:
    """The root layer with the look as its strongest sublayer; the manifest, which knows the root as ours if it was."""
    top, out = room.parent, dict[str, bytes]()
    current = ownership.read(top, room.name)
    root = Sdf.Layer.OpenAsAnonymous(str(room))
    mine = f"./{layer}"
    root.subLayerPaths = [mine, *(path for path in root.subLayerPaths if path != mine)]
    for path in shared:
        over = root.GetPrimAtPath(path)
        if over and over.HasInfo("instanceable"):
            over.instanceable = False  # a root layer's own opinion is stronger than the look's
    binary = (current or b"").startswith(b"PXR-USDC")
    fresh = layer_bytes(root, ".usdc" if binary else ".usda")
    out[room.name] = fresh
    manifest = find_manifest(top, room.stem)
    recorded = dict(manifest["files"]) if manifest else {}
    if current and not binary and recorded.get(room.name) != folders.digest(current) and loses_text(current):
        kept = folders.backup_name(top, room.name)
        folders.tell_kept(top, room.name, kept)
        out[kept] = current
    listing = f"{room.stem}.json"
    if manifest and manifest["name"] == room.stem and current is not None:
        owned = dict(manifest["files"])
        if owned.get(room.name) == folders.digest(current):
            owned[room.name] = folders.digest(fresh)
        unfit = ownership.read(top, UNFIT)
        if unfit is not None and owned.get(UNFIT) == folders.digest(unfit):
            out[UNFIT] = _fitting_again(unfit, layer)
            owned[UNFIT] = folders.digest(out[UNFIT])
        content = json.loads((top / listing).read_bytes())
        last = content["history"][-1] if content.get("history") else {}
        if last.get("leaves", {}).get(room.name) == folders.digest(current):
            last["leaves"][room.name] = folders.digest(fresh)  # the edit can still be taken back
        out[listing] = (json.dumps({**content, "files": dict(sorted(owned.items()))}, indent=1) + "\n").encode()
    return out


def _fitting_again(unfit: bytes, layer: str) -> bytes:
    """The layer of what fits no longer without what it says of a look that is imported anew."""
    found = Sdf.Layer.CreateAnonymous(".usda")
    found.ImportFromString(unfit.decode("utf-8"))
    name = Path(layer).stem
    mine = (f"collection:{name}:includes", f"primvars:{paintings.primvar(name)}")
    for prim in prim_specs(found):
        for spec in [spec for spec in prim.properties if spec.name.removesuffix(":indices") in mine]:
            prim.RemoveProperty(spec)
    return layer_bytes(found, ".usda")


ROUGHNESS = 0.75


def look_files(
    stage: Usd.Stage, surfaces: Surfaces, results: Results, name: str, tool: str, dressing: str
) -> dict[str, bytes]:
    """Path in the room's folder -> content.

    Arguments:
        stage: the room, whose units the layers take. surfaces: what it holds. results: what was painted.
        name: of the look. tool: who painted it. dressing: see `read_surfaces`.
    """
    objects, pictures = results
    painted = [thing for thing in surfaces.objects if thing.name in objects]
    pens = Pen(Sdf.Layer.CreateAnonymous(".usda")), Pen(Sdf.Layer.CreateAnonymous(".usda"))
    for pen, chosen in zip(pens, (name, None), strict=True):
        set_units(pen.layer, stage)
        pen.layer.defaultPrim = surfaces.room.split("/")[1]
        inside = pen.variants(surfaces.room, VARIANTS, (MADE, name), chosen)[name]
        for thing in painted:
            st, images = objects[thing.name]
            if chosen:
                _bind(inside, surfaces.room, thing, images, name)
            else:
                _lay_out(inside, thing, st, name)
    for path in dict.fromkeys(path for thing in painted for piece in thing.pieces for path in piece.instances):
        pens[0].over(path, instanceable=False)  # each gets a picture of its own
    top, laid = (pen.layer for pen in pens)
    top.documentation = "Painted by a texturing tool. Yours: no generation touches it."
    top.customLayerData = {
        "generator": f"echousd {echousd.__version__}",
        RECORD: {
            "name": name,
            "tool": tool,
            "dressing": dressing,
            "objects": {thing.path: thing.topology for thing in painted},
            "meshes": Vt.StringArray([piece.path for thing in painted for piece in thing.pieces]),
        },
    }
    top.subLayerPaths = [f"./{name}/st.usdc"]
    files = {f"{FOLDER}/{name}/{picture}": content for picture, content in sorted(pictures.items())}
    files[f"{FOLDER}/{name}/st.usdc"] = layer_bytes(laid, ".usdc")
    files[f"{FOLDER}/{name}.usda"] = layer_bytes(top, ".usda")
    return files


def _bind(pen: Pen, room: str, thing: Painted, images: Mapping[str, str], name: str) -> None:
    """One material for the object, over whatever its meshes and subsets are bound to."""
    material, chosen = f"{room}/Looks/{name}_{thing.name}", f"collection:{name}"
    _material(pen, material, images, name)
    kept = [path for piece in thing.pieces for path in piece.kept]
    values = {
        f"uniform token {chosen}:expansionRule": "expandPrims",
        f"rel {chosen}:includes": [piece.path for piece in thing.pieces if piece.path not in kept],
    }
    inner = [path for piece in thing.pieces for path in piece.kept if path != piece.path]
    if inner:
        values[f"rel {chosen}:excludes"] = inner
    binding = f"material:binding:{chosen}"
    values[f"rel {binding}"] = [f"{thing.path}.{chosen}", material]
    owner = pen.over(thing.path, values, [f"CollectionAPI:{name}", "MaterialBindingAPI"])
    owner.relationships[binding].SetInfo("bindMaterialAs", "strongerThanDescendants")


def _material(pen: Pen, path: str, images: Mapping[str, str], name: str) -> None:
    pen.define(path.rpartition("/")[0], "Scope")
    inputs = {"color": {"diffuseColor": "rgb"}, "metal_rough": {"roughness": "g", "metallic": "b"}}
    inputs["normal"] = {"normal": "rgb"}
    shown = [Image(word, f"./{name}/{images[word]}", fed) for word, fed in inputs.items() if word in images]
    plain = {} if "metal_rough" in images else {"roughness": ROUGHNESS, "metallic": 0.0}
    preview_surface(pen, path, plain, shown, primvar(name), "clamp")


def _lay_out(pen: Pen, thing: Painted, laid: np.ndarray, name: str) -> None:
    """The primvar of the look on every mesh of an object."""
    start = 0
    for piece in thing.pieces:
        own = laid[start : start + len(piece.corners)]
        start += len(piece.corners)
        corner = np.zeros((piece.size, 2), np.float32)
        corner[piece.corners.reshape(-1)] = own.reshape(-1, 2)
        values, index = np.unique(corner, axis=0, return_inverse=True)
        st = f"primvars:{primvar(name)}"
        index = index.reshape(-1).astype(np.int32)
        mesh = pen.over(piece.path, {f"texCoord2f[] {st}": values, f"int[] {st}:indices": index})
        mesh.attributes[st].SetInfo("interpolation", "faceVarying")
