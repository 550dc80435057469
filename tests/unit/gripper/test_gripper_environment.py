"""Air from -20 to 60 °C and 0.5 to 1.1 bar: fluid, fit of the grains and time step."""

import numpy as np
import pytest

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, build_plan
from ajgdata.gripper.medium import Air

NUMERICS = {"dx_mm": 4.7, "scheme": "second"}


def test_scenes_up_to_30_degrees_share_a_time_step_and_hotter_ones_shorten_theirs():
    plans = {
        celsius: build_plan(Scene(environment={"temperature_c": celsius}, numerics=NUMERICS))
        for celsius in (-20.0, 30.0, 60.0)
    }
    # c √3 / (0.99 · 4.7 mm · 44.1 kHz) is 2.95 for c = 349 m/s and 3.09 for c = 366 m/s.
    assert [plans[celsius].steps_per_sample for celsius in plans] == [3, 3, 4]
    for celsius, plan in plans.items():
        assert plan.system.dt * SAMPLE_RATE_HZ * plan.steps_per_sample == pytest.approx(1)
        courant = Air(celsius).sound_speed * np.sqrt(3) * plan.system.dt / 4.7e-3
        assert courant <= 0.99
