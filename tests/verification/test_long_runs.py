"""Many steps: no growth, no drift, whatever the precision."""

import pytest

from ajgdata.studies.verification.endurance import (
    LongRunDriven,
    LongRunLossless,
    LongRunLosslessSingle,
    StaticDrift,
    StaticDriftSingle,
)

RUNS = (LongRunLossless, LongRunLosslessSingle, StaticDrift, StaticDriftSingle, LongRunDriven)


@pytest.mark.parametrize("case", RUNS)
def test_fifty_thousand_steps(case):
    finding = case().run(quick=True)
    assert finding.passed, finding


@pytest.mark.slow
@pytest.mark.parametrize("case", RUNS)
def test_a_million_steps(case):
    finding = case().run()
    assert finding.passed, finding
