"""What furniture made of parts is scored on: sizes that such furniture comes in."""

import numpy as np
import pytest

from echomodel.metrics.parts_evaluation import usual_size
from echomodel.rules.living.sizes import size_range


@pytest.mark.parametrize("category", ["kids_bed", "desk", "floor_lamp"])
def test_sizes_are_those_a_person_takes_for_one_of_the_kind(category):
    rng = np.random.default_rng(3)
    sizes = np.array([usual_size(category, rng) for _ in range(400)])
    low, high = map(np.array, size_range(category))
    assert (sizes >= low).all()
    assert (sizes <= high).all()
    assert (sizes.std(0) > 0.02).all()
