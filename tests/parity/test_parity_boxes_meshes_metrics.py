"""Box normalisation, mesh fitting and set metrics against the published ones."""

from __future__ import annotations

import numpy as np
import torch
from parity_numbers import Numbers, close
from published_shapes import box_corners, fit_to_box

from echomodel.boxes import Boxes
from echomodel.metrics.pointsets import compare_sets
from echoscene.checkpoint import statistics_from_bounds


def test_boxes() -> None:
    numbers = Numbers("boxes")
    statistics = statistics_from_bounds(numbers["stats"].tolist())
    raw = numbers["param7"].float()
    close(Boxes(raw[:, :3], raw[:, 3:6], raw[:, 6]).encode(statistics.scale()), numbers["net_vector"], 2e-6)
    found = Boxes.decode(numbers["pred"], statistics.scale())
    close(torch.cat([found.size, found.position], dim=1), numbers["pred_boxes"], 1e-5)
    close(torch.rad2deg(found.yaw)[:, None], numbers["pred_angle_deg"], 1e-4)


def test_mesh_fitting() -> None:
    numbers = Numbers("fit_mesh")
    box = numbers["box_deg"].double().numpy()
    box[6] = np.deg2rad(box[6])
    close(torch.from_numpy(fit_to_box(numbers["vertices"].numpy(), box)), numbers["fitted"], 1e-5)
    found, expected = torch.from_numpy(box_corners(box)), numbers["box_corners"]
    nearest = torch.cdist(found, expected).amin(1)  # the corners' order is a matter of taste
    assert float(nearest.max()) < 1e-5
    assert float(torch.cdist(expected, found).amin(1).max()) < 1e-5


def test_set_metrics() -> None:
    numbers = Numbers("metrics_mmd")
    scores = compare_sets(numbers["samples"], numbers["refs"])
    for name in ("mmd", "mmd_smp", "cov"):
        assert abs(scores[name] - float(numbers[f"lgan_{name}-CD"])) < 1e-5, name
    for name in ("acc", "acc_t", "acc_f"):
        assert abs(scores[name] - float(numbers[f"1-NN-CD-{name}"])) < 1e-6, name
