"""What the tests of the package share."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from unittest.mock import patch

import pytest


@pytest.fixture(autouse=True, scope="session")
def fine_things_are_coarse() -> Iterator[None]:
    """Previews of few pixels, two drafts of eight, and three of the forty steps that mend what is drawn, not placed."""
    with (
        patch("echousd.make.save.PREVIEW", 96),
        patch("echousd.make.save.SHEET", 64),
        patch("echousd.make.layouts.DRAFTS", 2),
        patch("echomodel.compact.sampling.AFTER", 3),
    ):
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
