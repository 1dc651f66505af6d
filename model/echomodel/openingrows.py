"""Openings as padded rows of numbers: what the layout denoiser is told about doors, passages and windows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from echomodel.boxes import Boxes
from echomodel.boxes2d import axes
from echomodel.openings import STEP, WINDOW_DEPTH, Opening, inward_normal, segment

ROW = 10  # x0, z0, x1, z1 of the jambs, x and z of the inward normal, depth that stays free, sill, top, 1 = window
ROUND_ABOUT, NEAR, FAR = 0.4, 0.08, 3.0  # metres: scales at which a gap is told
OPENING_FEATURES = 10 + 12
PLAN = 11


def opening_rows(openings: Sequence[Opening], polygon: np.ndarray) -> Tensor:
    """(o, ROW) float32, metres, in the room frame of `Boxes`, whose origin is the middle of the floor's bounding box.

    Arguments:
        openings: of one room. polygon: (k, 2) float, corners (x, z) of its floor in any frame, metres.
    """
    corners = np.asarray(polygon, float)
    middle = (corners.max(0) + corners.min(0)) / 2 if len(openings) else np.zeros(2)
    rows = []
    for opening in openings:
        window = opening.kind == "window"
        depth = WINDOW_DEPTH if window else opening.width if (opening.kind, opening.swing) == ("door", "in") else STEP
        near, far = segment(corners, opening) - middle
        top = opening.sill + opening.height
        rows.append([*near, *far, *inward_normal(corners, opening.edge), depth, opening.sill, top, float(window)])
    return torch.tensor(rows, dtype=torch.float32).reshape(-1, ROW)


def padded_rows(rows: Sequence[Tensor]) -> Tensor:
    """Rows (s, o, ROW) of different numbers of openings behind one another, padded with NaN: (S, O, ROW)."""
    most = max((part.shape[1] for part in rows), default=0)
    return torch.cat([torch.nn.functional.pad(r, (0, 0, 0, most - r.shape[1]), value=torch.nan) for r in rows])


def room_features(rows: Tensor) -> tuple[Tensor, Tensor]:
    """Every opening as numbers (S, O, PLAN), zeros for padding, and which are there, (S, O) float32."""
    there = torch.isfinite(rows[..., 0])
    rows = torch.where(there[..., None], rows, torch.zeros_like(rows))
    width = (rows[..., 2:4] - rows[..., :2]).norm(dim=-1, keepdim=True)
    told = torch.cat([rows[..., :4] / 2, rows[..., 4:6], width, rows[..., 6:]], dim=-1)
    return told, there.to(rows.dtype)


def clearances(boxes: Boxes, rows: Tensor) -> Tensor:
    """How far each box keeps from the door or passage, and the window, that it comes nearest to, at several scales.

    Arguments:
        boxes: N boxes. rows: (N, O, ROW), openings of the room of each, NaN = none.

    Returns (N, OPENING_FEATURES) float32; zeros where there is no opening of the kind.
    """
    if not rows.shape[1]:
        return boxes.size.new_zeros(len(boxes), OPENING_FEATURES)
    there, window, beside, before, under = _gaps(boxes, rows)
    out = []
    for mask, gaps in ((there & ~window, (beside, before)), (there & window, (beside, before, under))):
        clear = torch.stack(gaps[:2]).amax(0)
        nearest = torch.where(mask, clear, torch.full_like(clear, FAR * 10)).argmin(1, keepdim=True)
        some = mask.any(1, keepdim=True).to(clear.dtype)
        chosen = torch.cat([gap.gather(1, nearest) for gap in (*gaps[:2], clear)], 1)
        told = [torch.tanh(chosen / scale) for scale in (FAR, ROUND_ABOUT, NEAR)]
        told += [torch.tanh(gap.gather(1, nearest) / s) for gap in gaps[2:] for s in (ROUND_ABOUT, NEAR)]
        out.append(torch.cat([torch.cat(told, 1) * some, some], 1))
    return torch.cat(out, 1)


def kept_free(boxes: Boxes, rows: Tensor) -> Tensor:
    """How far each box keeps out of the way of the openings of its room: the least of all, metres, differentiable.

    Arguments:
        boxes: N boxes that stand on the floor. rows: (N, O, ROW), openings of the room of each, NaN = none.

    Returns (N,) float32, negative in the way of a door or passage, or before a window and higher than its sill; `FAR`
    where there is no opening.
    """
    if not rows.shape[1]:
        return boxes.size.new_full((len(boxes),), FAR)
    there, window, beside, before, under = _gaps(boxes, rows)
    clear = torch.maximum(beside, before)
    clear = torch.where(window, torch.maximum(clear, under), clear)
    return torch.where(there, clear, torch.full_like(clear, FAR)).amin(1).clamp_max(FAR)


def _gaps(boxes: Boxes, rows: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
    """(N, O) each: which openings there are and which are windows; how far each box stands beside, before and below."""
    there = torch.isfinite(rows[..., 0])
    rows = torch.where(there[..., None], rows, torch.zeros_like(rows))
    near, far, inward = rows[..., 0:2], rows[..., 2:4], rows[..., 4:6]
    length = (far - near).square().sum(-1).clamp_min(1e-9).sqrt()
    along = (far - near) / length[..., None]
    off = boxes.position[:, None, [0, 2]] - (near + far) / 2
    half = boxes.size[:, None, [0, 2]] / 2

    def reach(direction: Tensor) -> Tensor:
        parts = [(direction * axis[:, None]).sum(-1).abs() for axis in axes(boxes.yaw)]
        return (torch.stack(parts, -1) * half).sum(-1)

    beside = (off * along).sum(-1).abs() - reach(along) - length / 2
    before = (off * inward).sum(-1) - reach(inward) - rows[..., 6]
    under = rows[..., 7] - (boxes.position[:, 1] + boxes.size[:, 1])[:, None]
    return there, rows[..., 9] > 0.5, beside, before, under
