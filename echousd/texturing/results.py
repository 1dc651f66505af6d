"""What a tool made of a job: for every object its picture, and its texture coordinates where the tool made its own."""

import re
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from echomodel.furniture.solids import rotation
from echousd.folder.within import check_links
from echousd.textures import TextureError, decoded, encoded, texture_bytes
from echousd.texturing.atlas import Unwrapped
from echousd.texturing.job import JOB, RESULTS, Job, JobObject, job_mesh
from echousd.texturing.obj import read_glb, read_obj
from echousd.texturing.scenetex import OUTPUTS

IMAGES = (".png", ".jpg", ".jpeg")
STEP = re.compile(r"^texture_(\d{1,9})\.png$")
SCENE = "scene"


# of an object: (t, 3, 2) float, where the job's triangles lie in the pictures, and `color`, perhaps `metal_rough` and
# `normal` -> name of a picture
Result = tuple[np.ndarray, Mapping[str, str]]
Results = tuple[dict[str, Result], dict[str, bytes]]


def read_results(folder: Path, job: Job) -> Results:
    """What came back in a job's folder: object name -> result, and name of a picture (with its ending) -> image.

    Objects without a result are left out, and with a warning files that are named after no object.
    Raises ValueError that names the file or the object for results that cannot be used, and where there are none.
    """
    found = _one_picture(folder, job) if job.one_picture else _many_pictures(folder, job)
    if not found[0]:
        one, many = f"{OUTPUTS}/*/vsd/*/texture_<step>.png", f"{RESULTS}/<object>.png"
        place = f"{RESULTS}/scene.png or {one}" if job.one_picture else f"{RESULTS}/<object>.glb or {many}"
        raise ValueError(f"{folder}: no results, expected {place}; paint the job first (see {folder / JOB})")
    return found


def _one_picture(folder: Path, job: Job) -> Results:
    """SceneTex: a picture of everything."""
    picture = _beside(folder, SCENE, IMAGES) or _last_step(folder)
    if picture is None:
        return {}, {}
    name, content = image_of(texture_bytes(str(picture)) or b"", str(picture), SCENE)
    objects: dict[str, Result] = {}
    for number, thing in enumerate(job.objects):
        sent = job_mesh(folder, thing)
        own = picture.parent / "meshes" / thing.kind / f"{number}_{thing.name}.obj"
        st = sent.corners
        if own.is_file():
            check_links(folder, own, f"object {thing.name!r}")
            back = read_obj(own)
            st = _aligned(sent, back, thing)
        # Its pictures' first and last texels lie on the borders 0 and 1, and not half a texel inside.
        objects[thing.name] = (st * (job.resolution - 1) + 0.5) / job.resolution, {"color": name}
    return objects, {name: content}


def _aligned(sent: Unwrapped, back: Unwrapped, thing: JobObject) -> np.ndarray:
    """Texture coordinates of a mesh that came back, face by face where the order is the same."""
    if len(sent.faces) == len(back.faces) and np.abs(sent.triangles - back.triangles).max() < 1e-4:
        return np.clip(back.corners, 0.0, 1.0)
    return texture_coordinates(sent, back, thing.name)


def _many_pictures(folder: Path, job: Job) -> Results:
    objects: dict[str, Result] = {}
    pictures: dict[str, bytes] = {}
    for thing in job.objects:
        mesh = _beside(folder, thing.name, (".glb",)) or _beside(folder, f"glbs/{thing.name}", (".glb",))
        if mesh is not None:
            back, raw = read_glb(mesh)
            if "color" not in raw:
                raise ValueError(f"object {thing.name!r}: {mesh} has no base colour image")
            st, source = _aligned(job_mesh(folder, thing), back, thing), str(mesh)
        else:
            picture = _beside(folder, thing.name, IMAGES)
            if picture is None:
                continue
            own = _beside(folder, thing.name, (".obj",))
            sent = job_mesh(folder, thing)
            st = sent.corners if own is None else _aligned(sent, read_obj(own), thing)
            raw, source = {"color": texture_bytes(str(picture)) or b""}, str(picture)
            for slot in ("metal_rough", "normal"):
                more = _beside(folder, f"{thing.name}_{slot}", IMAGES)
                if more is not None:
                    raw[slot] = texture_bytes(str(more)) or b""
        images = {}
        for slot, content in raw.items():
            stem = thing.name if slot == "color" else f"{thing.name}_{slot}"
            images[slot], encoded = image_of(content, f"{source} ({slot})", stem)
            pictures[images[slot]] = encoded
        objects[thing.name] = st, images
    known = {f"{thing.name}{slot}" for thing in job.objects for slot in ("", "_metal_rough", "_normal")}
    for path in sorted((folder / RESULTS).glob("*.*")):
        if path.suffix.lower() in (*IMAGES, ".glb") and path.stem not in known:
            warnings.warn(f"{path}: no object of the job is called {path.stem!r}; it is left out", stacklevel=4)
    return objects, pictures


def image_of(content: bytes, where: str, stem: str) -> tuple[str, bytes]:
    """Name and bytes of a picture that was read with doubt: PNG and JPEG as they are, others as PNG.

    Raises TextureError, which calls it `where`, for what is no image or too large.
    """

    if not content:
        raise TextureError(f"{where}: an empty file, allowed: an image")
    pixels = decoded(content, where)
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        return f"{stem}.png", content
    if content.startswith(b"\xff\xd8"):
        return f"{stem}.jpg", content
    return f"{stem}.png", encoded(Image.fromarray(pixels))


def _beside(folder: Path, stem: str, endings: tuple[str, ...]) -> Path | None:
    """The first file of a name among the results of a job, links inside it only."""
    for ending in endings:
        path = folder / RESULTS / f"{stem}{ending}"
        if path.is_symlink() or path.exists():
            check_links(folder, path, f"{folder}: {RESULTS}/{stem}{ending}")
            if not path.is_file():
                raise ValueError(f"{path}: not a regular file, allowed: a result of the tool")
            return path
    return None


def _last_step(folder: Path) -> Path | None:
    """The picture of the highest step of any run, of the run that was written to last among equals."""
    found = []
    for path in (*(folder / OUTPUTS).glob("*/vsd/*/texture_*.png"), *(folder / RESULTS).glob("texture_*.png")):
        step = STEP.match(path.name)
        if step and path.is_file():
            check_links(folder, path, f"{folder}: {path.relative_to(folder)}")
            found.append((int(step[1]), path.stat().st_mtime, str(path)))
    return Path(max(found)[2]) if found else None


TOLERANCE = 5e-5  # of the diagonal of the object
HALF = np.pi / 2
TURNS = [  # about +Y, +X and back: what exporters do with "up" and "forward"
    np.rint(rotation(x, y)) for x, y in ((0.0, 0.0), (-HALF, 0), (HALF, 0), (0, np.pi), (0, HALF), (0, -HALF))
]


def texture_coordinates(sent: Unwrapped, back: Unwrapped, name: str) -> np.ndarray:
    """(t, 3, 2) float, for each corner of the mesh that was given out, where it lies in the picture that came back.

    Accepted: vertices split, joined and re-ordered, triangles re-ordered and begun at another corner, triangles without
    area or lying on an equal one left out, and the whole turned by quarters, moved and scaled evenly. Raises ValueError
    with the object's name for other triangles (remeshed, decimated, mirrored), and for coordinates outside of [0, 1].

    Arguments:
        sent: what the job holds. back: what the tool made of it. name: of the object.
    """
    best, st = len(sent.faces), None
    for turn in TURNS:
        found = _found(_fitted(back.triangles @ turn.T, sent.triangles), sent.triangles, back.corners)
        if isinstance(found, int):
            best = min(best, found)
        else:
            st = found
            break
    if st is None:
        raise ValueError(
            f"object {name!r}: {len(back.faces)} triangles came back, and {best} of the {len(sent.faces)} that were "
            "given are not among them; allowed: the same triangles in any order (no remeshing, no decimation): turn "
            f"that off in the tool, bake its colours onto meshes/{name}.obj, or leave the object out with --skip {name}"
        )
    if st.min() < -1e-3 or st.max() > 1 + 1e-3:
        raise ValueError(
            f"object {name!r}: texture coordinates from {st.min():.3f} to {st.max():.3f} came back, allowed: 0 to 1"
        )
    return np.clip(st, 0.0, 1.0)


def _fitted(corners: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Corners moved and scaled evenly so that their box is that of the wanted ones."""
    low, high = corners.reshape(-1, 3).min(0), corners.reshape(-1, 3).max(0)
    first, last = wanted.reshape(-1, 3).min(0), wanted.reshape(-1, 3).max(0)
    scale = np.linalg.norm(last - first) / max(float(np.linalg.norm(high - low)), 1e-12)
    return (corners - (low + high) / 2) * scale + (first + last) / 2


def _found(corners: np.ndarray, wanted: np.ndarray, st: np.ndarray) -> np.ndarray | int:
    """Texture coordinates of the wanted triangles, (t, 3, 2), from others that lie at the same places.

    Arguments:
        corners: (s, 3, 3) triangles that came back, where the wanted ones (t, 3, 3) are. st: (s, 3, 2) of them.

    Returns how many are missing where some are, or where there are others besides.
    """
    near = TOLERANCE * max(float(np.linalg.norm(np.ptp(wanted.reshape(-1, 3), axis=0))), 1e-9)
    begun, coordinates = (np.concatenate([np.roll(each, -k, axis=1) for k in range(3)]) for each in (corners, st))
    ours, theirs = wanted.reshape(-1, 9), begun.reshape(-1, 9)
    _, row = cKDTree(theirs).query(ours, p=np.inf, distance_upper_bound=near)
    _, back = cKDTree(ours).query(theirs, p=np.inf, distance_upper_bound=near)
    lost, strange = row == len(theirs), (back == len(ours)).reshape(3, -1).all(0)
    missing = max(int((lost & ~_flat(wanted, near)).sum()), int((strange & ~_flat(corners, near)).sum()))
    if missing:
        return missing
    out = coordinates[np.where(lost, 0, row)]
    _, corner = cKDTree(corners.reshape(-1, 3)).query(wanted[lost])  # without area: where their places are
    out[lost] = st.reshape(-1, 2)[corner]
    return out


def _flat(triangles: np.ndarray, near: float) -> np.ndarray:
    """(t,) bool: triangles (t, 3, 3) two corners of which are at one place."""
    return np.asarray((np.abs(triangles - np.roll(triangles, 1, axis=1)) < near).all(2).any(1))
