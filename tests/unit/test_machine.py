"""Speed of the machine relative to the reference."""

import pytest

from ajgdata.pipeline import machine
from ajgdata.pipeline.machine import REFERENCE, calibrate, relative_speed


def test_the_reference_has_speed_one_and_each_kind_has_the_same_weight():
    assert relative_speed(REFERENCE) == pytest.approx(1)
    assert relative_speed({name: 2 * rate for name, rate in REFERENCE.items()}) == pytest.approx(2)
    for name, rate in REFERENCE.items():
        assert relative_speed({**REFERENCE, name: 8 * rate}) == pytest.approx(2)


def test_the_number_of_operations_does_not_depend_on_the_machine(monkeypatch):
    """With a clock that advances by 1 s per reading, the rates are the numbers of operations."""
    seconds = iter(range(100))
    monkeypatch.setattr(machine.time, "process_time", lambda: next(seconds))
    rates = calibrate()
    # Rounding to whole calls changes a third of a second of work by less than half a call.
    half = {"transforms": 5 * 2**14 * 14 / 2, "products": 256**3, "additions": 5e4}
    assert rates.keys() == REFERENCE.keys()
    for name, operations in rates.items():
        assert abs(operations - REFERENCE[name] / 3) <= half[name]
