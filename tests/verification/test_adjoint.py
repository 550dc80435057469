"""The divergence is the adjoint of the gradient: where the energy comes from."""

from ajgdata.studies.discrete import operator
from ajgdata.studies.domains import BOWL, bowl, closed
from ajgdata.studies.verification.identities import Adjoint


def test_the_marched_operator_is_self_adjoint():
    finding = Adjoint().run(quick=True)
    assert finding.passed, finding


def test_a_uniform_pressure_does_not_move():
    _, system = closed(bowl(), 6e-3, *BOWL)
    matrix = operator(system)
    # Each row has one entry per neighbour; their sum may round once each.
    assert abs(matrix.sum(axis=1)).max() < 8 * 2.3e-16 * abs(matrix).max()
