"""Rooms from above: where things lie in them, how bright they are, and what weights from the disk see in them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from echomodel.metrics.pictures import cnn_accuracy, features, picture, picture_figures
from echomodel.roomboxes import RoomBoxes
from echomodel.rooms.generator import generate_rooms

FLOOR = np.array([[-2, -2], [2, -2], [2, 2], [-2, 2]], float)


def room_with(word, size, position, yaw=0.0):
    return RoomBoxes(
        "one", "bedroom", FLOOR, 2.6, (word,), np.array([size], float), np.array([position], float), np.array([yaw])
    )


def test_a_box_lies_where_the_paper_camera_sees_it():
    shown = picture(room_with("wardrobe", (2.0, 2.0, 1.0), (1.0, 0.0, -0.5)), 0)
    assert shown.shape == (256, 256, 3)
    z, x = np.nonzero((shown < 255).any(2))
    scale = 128 / (8 - 2)  # pixels to a metre on its top, seen under 90 degrees from 8 m; 128 / 8 on the floor
    assert (x.min(), x.max() + 1) == pytest.approx((128, 128 + 2 * scale), abs=1.5)
    assert (z.min(), z.max() + 1) == pytest.approx((128 - scale, 128), abs=1.5)


def test_it_shines_as_the_published_shader_says():
    shown = picture(room_with("wardrobe", (3.0, 2.0, 3.0), (0.0, 0.0, 0.0)), 0)
    # light, camera and normal in one line: Fresnel 0.04 * 0.8 + 0.3 * 0.2, spread 1 / (pi 0.64^2), nothing masked
    fresnel, spread = 0.092, 1 / (np.pi * 0.64**2)
    light = (2 + 20 / 6**2) * ((1 - fresnel) * 0.3 * 0.96 * 0.8 / np.pi + fresnel * spread / 4.001)
    hue = np.array([0.86, 0.34, 0.5371])  # the 14th of 14 hues of seaborn, lightness 0.6, saturation 0.65
    assert shown[128, 128] == pytest.approx(255 * (light * hue) ** (1 / 2.2), abs=3)


def test_lamps_and_what_is_not_there_are_not_seen():
    assert (picture(room_with("pendant_lamp", (1, 1, 1), (0, 1, 0)), 0) == 255).all()
    empty = replace(room_with("wardrobe", (1, 1, 1), (0, 0, 0)), categories=(), size=np.zeros((0, 3)),
                    position=np.zeros((0, 3)), yaw=np.zeros(0))  # fmt: skip
    assert (picture(empty, 0) == 255).all()


class Means(torch.nn.Module):
    """Channel means and the side of what comes in."""

    def forward(self, x):
        return torch.cat([x.mean((2, 3)), torch.full((len(x), 1), float(x.shape[3]))], 1)[:, :, None, None]


class Net(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.layers = Means()

    def forward(self, x):
        return self.layers(x)


def test_features_are_those_of_weights_from_the_disk(tmp_path):
    torch.jit.script(Net()).save(str(tmp_path / "net.pt"))
    white, black = np.full((17, 256, 256, 3), 255, np.uint8), np.zeros((2, 256, 256, 3), np.uint8)
    seen = features(np.concatenate([white, black]), "inception", str(tmp_path / "net.pt"))
    assert seen.shape == (19, 4)
    assert seen[0].tolist() == pytest.approx([127 / 128] * 3 + [299])  # (x - 128) / 128 at 299 pixels, as clean-fid
    assert seen[-1].tolist() == pytest.approx([-1.0] * 3 + [299])
    (tmp_path / "bad.pt").write_bytes(b"no weights")
    for kind in ("inception", "clip"):
        with pytest.raises(ValueError, match=rf"bad.pt: .*--{kind} wants|CLIP weights .*bad.pt|open_clip"):
            features(white[:1], kind, str(tmp_path / "bad.pt"))


def test_their_distances_have_closed_forms():
    rng = np.random.default_rng(0)
    a, b = rng.normal(0, 1, (400, 3)), rng.normal(2, 3, (400, 3))
    found = picture_figures(a, b, ("FID", "KID x 1000"), 0)
    assert found["FID"].value == pytest.approx(3 * (2**2 + (3 - 1) ** 2), rel=0.1)  # of two normal distributions
    assert found["FID"].low <= found["FID"].value * 1.1
    assert picture_figures(a, b, ("FID-CLIP",), 0)["FID-CLIP"] == found["FID"]
    ones, zeros = np.ones((9, 4)), np.zeros((9, 4))
    assert picture_figures(ones, zeros, ("FID", "KID x 1000"), 0)["KID x 1000"].value == pytest.approx(7000)
    wide = rng.normal(0, 1, (12, 60))  # fewer pictures than numbers: by the matrix product of Heusel et al.
    other = wide @ rng.normal(0, 0.1, (60, 60))
    product = np.linalg.eigvals(np.cov(wide, rowvar=False) @ np.cov(other, rowvar=False))
    root = np.sqrt(product.real.clip(0)).sum()
    apart = ((wide.mean(0) - other.mean(0)) ** 2).sum() + wide.var(0, ddof=1).sum() + other.var(0, ddof=1).sum()
    assert picture_figures(wide, other, ("FID",), 0)["FID"].value == pytest.approx(apart - 2 * root, rel=1e-4)


def test_a_small_network_tells_what_differs_and_nothing_else(monkeypatch):
    monkeypatch.setattr("echomodel.metrics.pictures.STEPS", 20)
    shown = np.stack([picture(room, 0) for room in generate_rooms(12, 4)])
    assert cnn_accuracy(shown, 255 - shown, 0).value > 0.95
    same = cnn_accuracy(shown, shown, 0)
    assert same.value == pytest.approx(0.5)
    assert same == cnn_accuracy(shown, shown, 0)
