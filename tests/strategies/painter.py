"""A stand-in for a texturing tool: it paints a known function of the place in the room through a job's own layout."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from echousd.texturing.atlas import Unwrapped, texel_faces
from echousd.texturing.job import Job, JobObject, job_mesh, read_job


def color_at(points: np.ndarray) -> np.ndarray:
    """(n, 3) float in [0, 1]: a smooth function of the place (n, 3), metres."""
    x, y, z = points.T
    return 0.5 + 0.5 * np.stack([np.sin(5 * x), np.sin(5 * y + 1), np.sin(5 * z + 2)], 1)


def in_room(mesh: Unwrapped, thing: JobObject) -> np.ndarray:
    """(t, 3, 3) float, a job's triangles in the room."""
    to_room = np.array(thing.to_room)
    return mesh.triangles @ to_room[:3, :3].T + to_room[:3, 3]


def painted(st: np.ndarray, triangles: np.ndarray, resolution: int, over: np.ndarray | None = None) -> np.ndarray:
    """(r, r, 3) float picture of triangles (t, 3, 3), laid out by st (t, 3, 2): every texel that they touch.

    A texel that is only touched has the colour of a point of the edge in it.
    """
    picture = np.full((resolution, resolution, 3), np.nan) if over is None else over
    for first in range(3):
        a, b = st[:, first], st[:, (first + 1) % 3]
        steps = (np.linalg.norm(b - a, axis=1) * resolution * 4).astype(int) + 2
        face = np.repeat(np.arange(len(st)), steps)
        share = (np.arange(len(face)) - np.repeat(np.cumsum(steps) - steps, steps)) / (steps[face] - 1)
        share = share[:, None]
        places = a[face] * (1 - share) + b[face] * share
        points = triangles[face, first] * (1 - share) + triangles[face, (first + 1) % 3] * share
        texel = np.clip((np.stack([1 - places[:, 1], places[:, 0]], 1) * resolution).astype(int), 0, resolution - 1)
        picture[texel[:, 0], texel[:, 1]] = color_at(points)
    face, bary, place = texel_faces(st, resolution)
    picture[place[:, 0], place[:, 1]] = color_at(np.einsum("nc,ncx->nx", bary, triangles[face]))
    return picture


def filled(picture: np.ndarray) -> Image.Image:
    """The picture, unpainted texels as their painted neighbours are."""
    for _ in range(2):
        for step, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
            empty = np.isnan(picture[..., 0])
            picture[empty] = np.roll(picture, step, axis)[empty]
    return Image.fromarray((np.nan_to_num(picture, nan=0.5) * 255 + 0.5).astype(np.uint8))


def paint(folder: Path) -> Job:
    """Paint a whole job as its tool would: one picture, or one for each object."""
    job = read_job(folder)
    size, whole = job.resolution, None
    for thing in job.objects:
        mesh = job_mesh(folder, thing)
        if job.one_picture:  # SceneTex: first and last texels on the borders
            whole = painted((mesh.corners * (size - 1) + 0.5) / size, in_room(mesh, thing), size, whole)
        else:
            picture = painted(mesh.corners, in_room(mesh, thing), size)
            filled(picture).save(folder / "results" / f"{thing.name}.png")
    if whole is not None:
        filled(whole).save(folder / "results" / "scene.png")
    return job


STEEPEST = 2.5  # largest change of a colour a metre


def errors_in_texels(room: Path, job: Job, samples: int = 400) -> np.ndarray:
    """How far from its own colour every sampled point of a painted room is, in texels of its picture.

    What eight bits cannot tell is taken off.
    """
    from echousd.draw.drawables import image_of, read_drawables
    from echousd.stage.files import open_stage

    rng = np.random.default_rng(0)
    paths = {thing.path for thing in job.objects}
    images: dict[str, np.ndarray] = {}
    found = []
    for mesh in read_drawables(open_stage(room)):
        if not any(mesh.path.startswith(f"{path}/") for path in paths):
            continue
        owner = np.zeros(len(mesh.triangles), int)
        for number, (_, faces) in enumerate(mesh.paints):
            owner[faces] = number
        world = mesh.triangles @ mesh.world[:3, :3].T + mesh.world[:3, 3]
        area = np.linalg.norm(np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0]), axis=1) / 2
        for number, (paint, _) in enumerate(mesh.paints):
            own = np.flatnonzero((owner == number) & (area > 1e-7))
            if not len(own) or not paint.texture or paint.st == "st":
                continue
            picture = images.setdefault(paint.texture, image_of(paint.image, paint.texture))
            face = own[rng.choice(len(own), samples, p=area[own] / area[own].sum())]
            bary = rng.dirichlet((1, 1, 1), samples)
            assert mesh.st is not None
            st = np.einsum("nc,ncx->nx", bary, mesh.st[face])
            size = len(picture)
            texel = np.clip((np.stack([1 - st[:, 1], st[:, 0]], 1) * size).astype(int), 0, size - 1)
            shown = picture[texel[:, 0], texel[:, 1]] / 255
            wrong = np.abs(shown - color_at(np.einsum("nc,ncx->nx", bary, world[face]))).max(1)
            a, b = mesh.st[face, 1] - mesh.st[face, 0], mesh.st[face, 2] - mesh.st[face, 0]
            covered = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2 * size**2
            metres = np.sqrt(area[face] / np.maximum(covered, 1e-9))
            found.append(np.maximum(wrong - 0.5 / 255, 0) / STEEPEST / metres)
    return np.concatenate(found)
