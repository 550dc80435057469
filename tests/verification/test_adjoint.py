"""The divergence is the adjoint of the gradient: where the energy comes from."""

import numpy as np
import pytest

from ajgdata.studies.discrete_operator import operator
from ajgdata.studies.domains import BOWL, bowl, closed
from ajgdata.studies.verification.identities import Adjoint, WideAdjoint


@pytest.mark.parametrize("case", [Adjoint, WideAdjoint])
def test_the_marched_operator_is_self_adjoint(case):
    finding = case().run(quick=True)
    assert finding.passed, finding


class OneCellOff(Adjoint):
    """A cell whose pressure yields a millionth more than its volume says."""

    def system(self, h):
        system = super().system(h)
        system.capacities.yield_[np.argmax(system.mass)] *= 1.000001
        return system


def test_a_cell_in_error_is_found():
    assert not OneCellOff().run(quick=True).passed


def test_a_uniform_pressure_does_not_move():
    _, system = closed(bowl(), 6e-3, *BOWL)
    matrix = operator(system)
    # Each row has one entry per neighbour; their sum may round once each.
    assert abs(matrix.sum(axis=1)).max() < 8 * 2.3e-16 * abs(matrix).max()
