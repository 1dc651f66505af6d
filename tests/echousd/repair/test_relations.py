"""Margins that are written out are those of the rules."""

import numpy as np

from echomodel.vocabulary import vocabulary
from echousd.repair.relations import relation_margins


def test_facing_is_the_same_without_gradients():
    rng = np.random.default_rng(0)
    size, position, yaw = rng.uniform(0.3, 2.0, (20, 3)), rng.normal(0, 2, (20, 3)), rng.uniform(-4, 4, 20)
    looks = vocabulary().predicate_id("facing")
    rows = np.stack([rng.integers(0, 10, 99), np.full(99, looks), rng.integers(10, 20, 99)], 1)
    told = [
        relation_margins(size, position, yaw, rows, rules="strict", centre=np.zeros(2), slopes=slopes)[0]
        for slopes in (False, True)
    ]
    assert np.abs(told[0] - told[1]).max() < 1e-9
    assert 0 < (told[0] > 0).sum() < 99
