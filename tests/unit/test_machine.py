"""Speed of the machine relative to the reference."""

import pytest

from ajgdata.pipeline.machine import REFERENCE, relative_speed


def test_the_reference_has_speed_one_and_each_kind_has_the_same_weight():
    assert relative_speed(REFERENCE) == pytest.approx(1)
    assert relative_speed({name: 2 * rate for name, rate in REFERENCE.items()}) == pytest.approx(2)
    for name, rate in REFERENCE.items():
        assert relative_speed({**REFERENCE, name: 8 * rate}) == pytest.approx(2)
