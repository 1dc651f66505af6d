"""What a model is, where its name leaves it open and its shape does not."""

from __future__ import annotations

import numpy as np
import trimesh

from echousd.assets.shape import sampled

SAMPLES = 4000
OPEN, CLOSED = 0.35, 0.75  # share of the front that is filled, of open shelves at most and of closed ones at least
CORNER = 0.04  # share of a sofa's surface that lies in the quarter before one half of its back, at most
LOUNGE = 0.72  # metres: a chair as deep and as low as that is for leaning back
LOUNGE_HEIGHT = 0.95


def named_by_shape(category: str, mesh: trimesh.Trimesh, dims: np.ndarray) -> str:
    """A category, or the one beside it in the vocabulary that the shape tells.

    Arguments:
        category: by name. mesh: in the object frame, any unit. dims: (3) metres.
    """
    if category in ("multi_seat_sofa", "loveseat_sofa", "sofa") and dims[2] > 1.2 and dims[0] > 1.6:
        return "l_shaped_sofa" if _has_empty_corner(mesh) else category
    if category in ("bookshelf", "cabinet") and dims[1] > 0.5:
        filled = _front_filled(mesh)
        if category == "bookshelf" and filled > CLOSED:
            return "cabinet"
        return "bookshelf" if category == "cabinet" and filled < OPEN and dims[1] > 1.2 else category
    if category == "chair" and dims[2] > LOUNGE and dims[1] < LOUNGE_HEIGHT:
        return "lounge_chair"
    return category


def _places(mesh: trimesh.Trimesh) -> np.ndarray:
    """(n, 3) float, 0 to 1 in the mesh's box."""
    points = sampled(mesh, SAMPLES)[0]
    low, high = mesh.bounds
    return (points - low) / np.maximum(high - low, 1e-9)


def _has_empty_corner(mesh: trimesh.Trimesh) -> bool:
    at = _places(mesh)
    front = at[:, 2] > 0.7
    share = [float((front & side).mean()) for side in (at[:, 0] < 0.35, at[:, 0] > 0.65)]
    return min(share) < CORNER < max(share)


def _front_filled(mesh: trimesh.Trimesh, cells: int = 16) -> float:
    """Share of the front, seen squarely, behind which something stands in the first quarter of the depth."""
    at = sampled(mesh, 12_000)[0]
    low, high = mesh.bounds
    at = (at - low) / np.maximum(high - low, 1e-9)
    near = at[at[:, 2] > 0.8]
    seen = np.zeros((cells, cells), bool)
    seen[tuple((near[:, :2] * cells).astype(int).clip(0, cells - 1).T)] = True
    return float(seen.mean())
