"""The membrane between grains against its closed form and against the free membrane."""

import numpy as np
import pytest

from ajgdata.gripper.contact import Pack
from ajgdata.gripper.membrane import pinned, strip
from ajgdata.gripper.object_materials import MATERIALS

PACK = Pack(6e-3, 0.40, MATERIALS["plastic"])
TENSION, MASS = 43.0, 0.3


def test_the_span_has_the_stiffness_of_its_closed_form():
    # ⟨w⟩ = p R²/8T ((4 ln(1/s) - 3 + 4s² - s⁴)) for s = b/R.
    span, seats = pinned(200.0, PACK, TENSION, MASS), PACK.seats_per_m2
    square = 1 / (np.pi * seats)
    s = np.sqrt(200.0 / seats * 3e-3 / (2 * np.pi * TENSION) / square)
    mean = square / (8 * TENSION) * (-4 * np.log(s) - 3 + 4 * s**2 - s**4)
    assert span.stiffness_n_m3 == pytest.approx(1 / mean, rel=1e-6)


def test_a_strip_bulges_as_its_parabola():
    x = (np.arange(2_000) + 0.5) / 2_000 * 0.01
    sag = x * (0.01 - x) / (2 * TENSION)
    span = strip(0.01, TENSION, MASS)
    assert 1 / span.stiffness_n_m3 == pytest.approx(sag.mean(), rel=1e-6)
    assert span.mass_kg_m2 == pytest.approx(MASS * np.mean(sag**2) / sag.mean() ** 2, rel=1e-6)
