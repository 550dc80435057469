"""Every claim of the verification study, on coarse grids and in few steps; and that it can fail."""

import numpy as np
import pytest

from ajgdata.studies.known_cases.identities import (
    EnergyConstant,
    WaveDispersion,
)
from ajgdata.studies.verification import CASES

#: What a result must keep beside its own limits.
ALSO = {
    # The grid of 4 mm.
    **{name: lambda result: result.value < 4e-3 for name in CASES if name.startswith("bed_layer")},
    # The two really differ in precision.
    "single_precision": lambda result: result.value > 0,
}


@pytest.mark.parametrize("name", CASES)
def test_the_claim_holds(name):
    result = CASES[name].run(quick=True)
    assert result.passed, result
    assert ALSO.get(name, lambda result: True)(result), result


class EnergyOfACellInError(EnergyConstant):
    def start(self):
        system, state = super().start()
        system.capacities.yield_[np.argmax(system.mass)] *= 1 + 1e-3
        return system, state


class WaveOfThePlainScheme(WaveDispersion):
    def _symbol(self, k):
        return np.sin(k * self.h / 2)


@pytest.mark.parametrize("wrong", [EnergyOfACellInError, WaveOfThePlainScheme])
def test_a_claim_that_does_not_hold_is_found(wrong):
    assert not wrong().run(quick=True).passed
