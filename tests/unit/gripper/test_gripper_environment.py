"""Air from -20 to 60 °C and 0.5 to 1.1 bar: fluid, fit of the grains and time step."""

import numpy as np
import pytest

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, build_plan
from ajgdata.gripper.medium import Air
from ajgdata.gripper.solver_plan import wide_weight

NUMERICS = {"dx_mm": 4.2}


def test_scenes_up_to_30_degrees_share_a_time_step_and_hotter_ones_shorten_theirs():
    plans = {
        celsius: build_plan(Scene(environment={"temperature_c": celsius}, numerics=NUMERICS))
        for celsius in (-20.0, 30.0, 60.0)
    }
    # c √3 (1 + 4w) / (0.99 · 4.2 mm · 44.1 kHz) is 3.96 for c = 349 m/s and 4.16 for 366 m/s.
    assert [plans[celsius].steps_per_sample for celsius in plans] == [4, 4, 5]
    for celsius, plan in plans.items():
        assert plan.system.dt * SAMPLE_RATE_HZ * plan.steps_per_sample == pytest.approx(1)
        courant = Air(celsius).sound_speed * np.sqrt(3) * plan.system.dt / 4.2e-3
        assert courant <= 0.99 / (1 + 4 * wide_weight(4.2e-3))
