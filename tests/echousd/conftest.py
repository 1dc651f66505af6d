"""What the tests of the package share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext
from functools import wraps
from importlib.util import find_spec
from unittest.mock import patch

import numpy as np
import pytest
from few_cameras import FEW
from small_room import StandIn

from echomodel.files import digest
from echomodel.protocols import RoomModel
from echousd.make import layouts
from echousd.shapes.geometry import Geometry
from echousd.shapes.sources import whole


@pytest.fixture(autouse=True, scope="session")
def fine_things_are_coarse() -> Iterator[None]:
    """Previews of few pixels, two drafts of a stand-in, three of forty steps that mend what is drawn and not placed."""
    most = layouts.most_drafts

    def drafts(model: RoomModel, objects: int) -> int:
        return 2 if isinstance(model, StandIn) else most(model, objects)

    with (
        patch("echousd.make.save.PREVIEW", 96),
        patch("echousd.make.save.SHEET", 64),
        patch("echousd.make.furnishing.most_drafts", drafts),
        patch("echomodel.compact.sampling.AFTER", 3),
    ):
        yield


@pytest.fixture(autouse=True, scope="module")
def cameras_are_found_soon(request: pytest.FixtureRequest) -> Iterator[None]:
    """The cameras of a room are looked for at a dozen places; at two hundred where the test asks for what they see."""
    with nullcontext() if request.path.parent.name == "draw" else patch.multiple("echousd.draw.views", **FEW):
        yield


@pytest.fixture(autouse=True, scope="session")
def shapes_are_meshed_once() -> Iterator[None]:
    """The grids of stand-ins are the same ones in hundreds of rooms: of each there is one mesh with its colliders."""
    mesh, known = whole.within_budget, {}

    @wraps(mesh)
    def meshed(grid: np.ndarray, size: np.ndarray, category: str, faces: int) -> Geometry:
        key = digest(grid.tobytes()), size.tobytes(), category, faces
        if key not in known:
            known[key] = mesh(grid, size, category, faces)
        return known[key]

    with patch.object(whole, "within_budget", meshed):
        yield


@pytest.fixture(autouse=True, scope="session")
def solids_are_split_once() -> Iterator[None]:
    """CoACD takes a second for the convex pieces of a mesh, the same ones each time: of each it is asked once."""
    if not find_spec("coacd"):  # no wheel for this machine
        yield
        return
    import coacd

    run, known = coacd.run_coacd, {}

    def asked(mesh, **options):
        key = (mesh.vertices.tobytes(), mesh.indices.tobytes(), *sorted(options.items()))
        if key not in known:
            known[key] = run(mesh, **options)
        return known[key]

    with patch.object(coacd, "run_coacd", asked):
        yield
