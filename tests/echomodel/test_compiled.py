"""Functions of compiled modules: as their packages have them, without these."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import optimize

from echomodel.compiled import Compiled, linear_sum_assignment


@pytest.mark.parametrize("seed", range(5))
def test_the_compiled_assignment_is_that_of_scipy(seed):
    cost = np.random.default_rng(seed).integers(0, 4, (6, 6 + seed)).astype(float)  # ties
    np.testing.assert_array_equal(linear_sum_assignment(cost), optimize.linear_sum_assignment(cost))


def test_it_is_loaded_without_its_package():
    told = "import sys, numpy; from echomodel.compiled import linear_sum_assignment as of; of(numpy.eye(3)); "
    told += "print([name for name in sys.modules if name.startswith('scipy')])"
    assert subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_where_the_module_is_elsewhere_the_package_has_it():
    elsewhere = Compiled("scipy.optimize._elsewhere:linear_sum_assignment")
    assert elsewhere.itself is optimize.linear_sum_assignment
