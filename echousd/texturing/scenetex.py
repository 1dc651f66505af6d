"""What SceneTex reads of a job: cameras, meshes of stuff and things, its own parametrisation, a script to run it."""

import json
from collections.abc import Sequence

import numpy as np
import yaml
from trimesh.util import append_faces

from echousd.draw.surfaces import Painted
from echousd.texturing.atlas import Unwrapped
from echousd.texturing.job import script_for
from echousd.texturing.obj import obj_bytes
from echousd.texturing.viewpoints import AZIMUTHS, ELEVATIONS, FIELDS

RESOLUTION = 4096
ANCHORED = 512  # visible texels that an object needs, or it loses its style
STAMP = "echousd"
OUTPUTS = "outputs"


def mesh_path(number: int, thing: Painted, room: str) -> str:
    """Path of an object's OBJ in the job, which is its path in SceneTex's folder too."""
    return f"data/scenes/{room}/room/meshes/{thing.kind}/{number}_{thing.name}.obj"


def run_folder(prompt: str) -> str:
    """Where SceneTex writes a run of ours, in the job."""
    return f"{OUTPUTS}/{'_'.join(prompt.split(' '))}/vsd/{STAMP}"


def scenetex_files(
    room: str, prompt: str, prompts: Sequence[str], objects: Sequence[Painted], laid: Sequence[Unwrapped],
    at: np.ndarray, distance: float,
) -> dict[str, bytes]:  # fmt: skip
    """Path in the job -> content, of everything but `job.json`.

    Arguments:
        room, prompt: of the job. prompts: of the objects. objects: stuff first. laid: them in one picture.
        at: (3,) float, the point that cameras look through. distance: of the cameras from it, metres.
    """
    scene = f"data/scenes/{room}/room"
    config, seeded = {}, {}
    files: dict[str, bytes] = {f"{scene}/cameras/sphere.yaml": _sphere(at, distance)}
    run = f"{run_folder(prompt)}/meshes"
    for number, (thing, mesh, words) in enumerate(zip(objects, laid, prompts, strict=True)):
        path = mesh_path(number, thing, room)
        entry = {"name": thing.name, "type": thing.kind, "path": path, "prompt": words}
        config[str(number)] = entry
        seeded[str(number)] = {**entry, "num_vertices": len(mesh.points)}
        files[path] = obj_bytes(mesh, thing.name)
        files[f"{run}/{thing.kind}/{number}_{thing.name}.obj"] = obj_bytes(mesh, thing.name, material=False)
    for path, entries in ((f"{scene}/meshes", config), (run, seeded)):
        files[f"{path}/scene_config.json"] = (json.dumps(entries, indent=4) + "\n").encode()
    points, faces = append_faces([mesh.points for mesh in laid], [mesh.faces for mesh in laid])
    whole = Unwrapped(points, np.concatenate([mesh.st for mesh in laid]), faces)
    files[f"{run}/scene.obj"] = obj_bytes(whole, "scene", material=False)
    values = {"ROOM": room, "PROMPT": prompt, "SCENE": f"{room}/room", "STAMP": STAMP, "OUTPUTS": OUTPUTS}
    files["run.sh"] = script_for("scenetex", {**values, "ANCHORED": str(ANCHORED)})
    return files


def _sphere(at: np.ndarray, distance: float) -> bytes:
    space = {
        "dist": {"min": round(distance, 4), "max": round(distance, 4), "num_linspace": 1},
        "elev": {"min": ELEVATIONS[0], "max": ELEVATIONS[1], "num_linspace": 10},
        "azim": {"min": AZIMUTHS[0], "max": AZIMUTHS[1], "num_linspace": 100},
        "fov": {"min": FIELDS[0], "max": FIELDS[1], "num_linspace": 5},
        "at": [[float(v) for v in at]],
    }
    return yaml.safe_dump(space, sort_keys=False).encode()
