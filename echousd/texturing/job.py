"""A texture job on disk: its `job.json`, read back with doubt, as it may have been to other machines."""

import re
import shlex
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field, ValidationError

from echomodel.bounded import read_bounded
from echomodel.files import telling
from echousd.folder.within import inside
from echousd.graph.values import IDENTIFIER
from echousd.invalid import validation_message
from echousd.texturing.atlas import Unwrapped, layout_digest
from echousd.texturing.obj import read_obj

TOOLS = ("scenetex", "hunyuan", "mvpainter", "generic")
JOB = "job.json"
LARGEST = 32 * 2**20  # bytes of a job.json
RESULTS = "results"

Name = Annotated[str, Field(pattern=f"^{IDENTIFIER.pattern}$", max_length=200)]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{32}$")]
Row = tuple[float, float, float, float]


class JobCamera(BaseModel, frozen=True):
    """A camera: name, camera to world as rows (it looks along its -Z, +Y up, metres), field of view in degrees."""

    name: str
    matrix: tuple[Row, Row, Row, Row]
    fov: float


class JobObject(BaseModel, frozen=True):
    """One object of a job.

    Arguments:
        name, path, kind, category, style: see `Painted`. prompt: words for it.
        mesh: its OBJ in the job. image: a picture of it there, "" without one.
        triangles: of the mesh. topology, layout: digests of the room's meshes and of the texture coordinates.
        texels: of its picture that it covers. visible: how many of them a camera sees, None = not counted.
        to_room: (4, 4) rows, the mesh's frame to the room's, metres.
    """

    name: Name
    path: str
    kind: Literal["stuff", "things"]
    category: str
    style: str
    prompt: str
    mesh: str
    image: str = ""
    triangles: Annotated[int, Field(gt=0)]
    topology: Digest
    layout: Digest
    texels: int
    visible: int | None = None
    to_room: tuple[Row, Row, Row, Row]


class Job(BaseModel, frozen=True):
    """What `job.json` holds.

    Arguments:
        tool: whom it is for. room, palette, prompt: what is painted.
        resolution: texels along a picture. one_picture: all objects share one.
        dressing: what was asked for of the small things.
        cameras: in order. objects: stuff first, in order. left_out: name -> why it is not in the job.
    """

    echousd_texture_job: Literal[1] = 1
    tool: Literal["scenetex", "hunyuan", "mvpainter", "generic"]
    room: str
    palette: str
    prompt: str
    resolution: Annotated[int, Field(ge=64, le=16384)]
    one_picture: bool
    dressing: Literal["none", "grouped", "each"]
    cameras: tuple[JobCamera, ...]
    objects: Annotated[tuple[JobObject, ...], Field(min_length=1)]
    left_out: dict[str, str] = {}


def read_job(folder: Path) -> Job:
    """The job in a folder; raises ValueError that names the file and the field."""
    path = folder / JOB
    try:
        with telling(path, "cannot be read", ", allowed: the folder of texture export"):
            job = Job.model_validate_json(read_bounded(path, LARGEST))
    except ValidationError as error:
        raise ValueError(f"{path}: {validation_message(error)}") from None
    for thing in job.objects:
        inside(folder, thing.mesh, f"{path}: objects.{thing.name}.mesh")
    twice, count = Counter(thing.name for thing in job.objects).most_common(1)[0]
    if count > 1:
        raise ValueError(f"{path}: objects: {twice!r} comes twice, allowed: each name once")
    return job


def script_for(tool: str, words: Mapping[str, str] | None = None) -> bytes:
    """What runs a tool on a job: its file in `scripts/`, where `@WORD@` stands for a text that a shell has to read."""
    text = Path(__file__).with_name("scripts").joinpath(f"{tool}.sh").read_text("utf-8")
    return re.sub("@([A-Z]+)@", lambda word: shlex.quote((words or {})[word[1]]), text).encode()


def job_mesh(folder: Path, thing: JobObject) -> Unwrapped:
    """The mesh that a job gave out; raises ValueError, with the object's name, for one that was changed since."""
    path = inside(folder, thing.mesh, f"{folder / JOB}: objects.{thing.name}.mesh")
    mesh = read_obj(path)
    if len(mesh.faces) != thing.triangles:
        message = f"{len(mesh.faces)} triangles, {thing.triangles} were exported"
    elif layout_digest(mesh.corners) != thing.layout:
        message = "other texture coordinates than were exported"
    else:
        return mesh
    raise ValueError(f"object {thing.name!r}: {path} has {message}; put what a tool changed into {RESULTS}/")
