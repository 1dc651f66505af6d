"""Lights of a stage give the same in any unit and however their size is told."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdLux

from echousd.stage.encoding import StageError
from echousd.stage.lights import emitted


def given(kind, intensity, metres=1.0, **inputs):
    stage = Usd.Stage.CreateInMemory()
    made = kind.Define(stage, "/light")
    made.CreateIntensityAttr(intensity)
    for name, value in inputs.items():
        made.GetPrim().GetAttribute(f"inputs:{name}").Set(value)
    return emitted(made.GetPrim(), metres)


SIZES = [
    (UsdLux.SphereLight, {"radius": 0.1}, 4 * np.pi * 0.01),
    (UsdLux.DiskLight, {"radius": 0.1}, np.pi * 0.01),
    (UsdLux.RectLight, {"width": 0.4, "height": 0.5}, 0.2),
]


@pytest.mark.parametrize(("kind", "size", "surface"), SIZES)
@pytest.mark.parametrize("whole", [False, True])
def test_a_lamp_gives_the_same_in_metres_and_in_centimetres(kind, size, surface, whole):
    """Radiance times surface is 2 m²: normalised intensity holds the surface in the stage's unit, the other none."""
    for metres in (1.0, 0.01):
        told = {name: value / metres for name, value in size.items()}
        intensity = 1.0 / metres**2 if whole else 1.0 / surface
        found = given(kind, intensity, metres, normalize=whole, exposure=1.0, **told)
        np.testing.assert_allclose(found, 2.0, rtol=1e-5)


@pytest.mark.parametrize(("kind", "size", "surface"), SIZES)
def test_a_lamp_that_is_scaled_has_more_surface(kind, size, surface):
    for whole, gain in ((False, 4.0), (True, 1.0)):
        stage = Usd.Stage.CreateInMemory()
        UsdGeom.Xform.Define(stage, "/asset").AddScaleOp().Set((2.0, 2.0, 2.0))
        made = kind.Define(stage, "/asset/light")
        UsdGeom.Xformable(made).AddScaleOp().Set((1.0, 1.0, 1.0) if kind is UsdLux.SphereLight else (1.0, 1.0, 9.0))
        UsdLux.LightAPI(made).CreateNormalizeAttr(whole)
        for name, value in {"intensity": 3.0, **size}.items():
            made.GetPrim().GetAttribute(f"inputs:{name}").Set(value)
        expected = 3.0 * gain * (1.0 if whole else surface)
        np.testing.assert_allclose(emitted(made.GetPrim(), 1.0), expected, rtol=1e-5)


def test_a_sun_gives_its_disc_or_what_it_says():
    disc = np.pi * np.sin(np.radians(1.0) / 2) ** 2
    for metres in (1.0, 0.01):
        assert given(UsdLux.DistantLight, 3.0, metres, normalize=True) == pytest.approx([3.0] * 3)
        assert given(UsdLux.DistantLight, 3.0, metres, angle=1.0) == pytest.approx([3.0 * disc] * 3, rel=1e-5)
        assert given(UsdLux.DomeLight, 3.0, metres, normalize=True) == pytest.approx([3.0] * 3)


def test_colour_temperature_and_what_is_no_surface():
    warm = given(UsdLux.DomeLight, 1.0, enableColorTemperature=True, colorTemperature=2700.0)
    np.testing.assert_allclose(warm, np.clip(UsdLux.BlackbodyTemperatureAsRgb(2700.0), 0, None), rtol=1e-6)
    assert not given(UsdLux.SphereLight, 1.0, radius=0.0).any()
    assert given(UsdLux.SphereLight, 8e4, 0.01, radius=0.0, normalize=True) == pytest.approx([8.0] * 3)  # a point
    assert not given(UsdLux.CylinderLight, 1.0).any()
    with pytest.raises(StageError, match=r"</light>: inputs:intensity is nan"):
        given(UsdLux.DomeLight, float("nan"))
