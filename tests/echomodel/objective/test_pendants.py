"""Terms of what hangs over tables: over their middle, several in a row."""

from __future__ import annotations

import numpy as np
import pytest
from lived_in import DINING, PENDANTS

from echomodel.vocabulary import vocabulary


def test_a_pendant_that_is_told_to_hang_above_a_table_hangs_over_its_middle_even_beside_it():
    names = list(DINING.things)
    above = np.array([(names.index("pendant"), vocabulary().predicate_id("above"), names.index("table"))])
    beside = DINING.moved("pendant", at=(0.9, 0.0))  # 0.2 m beside the edge: in a room it may hang so
    assert ("pendant", "pendant_centred") not in beside.found()
    told = beside.found(relations=above)["pendant", "pendant_centred"]
    assert "pendant hangs 0.90 m off the middle of table" in told
    assert ("pendant", "pendant_centred") not in DINING.found(relations=above)


@pytest.mark.parametrize(("one", "other", "kept"), [(-0.4, 0.5, True), (0.0, 0.6, False), (0.0, 0.2, True)])
def test_of_two_pendants_none_hangs_over_the_middle_with_the_other_beside_it(one, other, kept):
    found = PENDANTS.moved("pendant_-1", at=(one, 0.0)).moved("pendant_1", at=(other, 0.0)).found()
    assert (("pendant_-1", "pendant_centred") not in found) == kept


def test_pendants_that_are_told_to_hang_above_a_table_hang_in_a_row_even_beside_it():
    across = PENDANTS.moved("pendant_1", at=(0.1, 0.5)).moved("pendant_-1", at=(-0.1, -0.5))  # their middle is its
    table, *lamps = (list(across.things).index(name) for name in ("table", "pendant_-1", "pendant_1"))
    told = [(lamp, vocabulary().predicate_id("above"), table) for lamp in lamps]
    assert ("pendant_-1", "pendants_in_row") in across.found(relations=np.array(told))
    assert ("pendant_-1", "pendants_in_row") not in across.found()
    assert ("pendant_-1", "pendants_in_row") not in PENDANTS.found(relations=np.array(told))
