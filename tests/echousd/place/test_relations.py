"""Margins that are written out are those of the rules."""

import numpy as np
import pytest

from echomodel.vocabulary import vocabulary
from echousd.place.relations import margins_at, relation_margins


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


@pytest.mark.parametrize("rules", ["strict", "sgfront"])
@pytest.mark.parametrize("apart", [0.4, 2.0])
def test_margins_of_many_poses_are_those_of_one_after_the_other(rules, apart):
    rng = np.random.default_rng(1)
    size, position, yaw = rng.uniform(0.3, 2.0, (6, 3)), rng.normal(0, apart, (6, 3)), rng.uniform(-4, 4, 6)
    poses, fronts = (rng.normal(0, apart, (7, 3)), rng.uniform(-4, 4, 7)), np.arange(6) != 4
    rows = [(0, p.id, j) for p in vocabulary().predicates for j in (1, 4)]
    rows += [(j, p.id, 0) for p in vocabulary().predicates for j in (2, 4)]
    by = {"rules": rules, "centre": np.array([0.3, -0.2]), "fronts": fronts}
    found = margins_at(0, poses, np.array(rows), size, position, yaw, **by)
    for k in range(7):
        position[0], yaw[0] = poses[0][k], poses[1][k]
        told, _ = relation_margins(size, position, yaw, np.array(rows), **by)
        np.testing.assert_allclose(found[k], told, atol=1e-9)
    assert (found > 0).any()
    assert (found < 0).any()
