"""Air from -20 to 60 °C and 0.5 to 1.1 bar: fluid, fit of the grains and time step."""

import numpy as np
import pytest

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, build_plan
from ajgdata.gripper.medium import FIT_BAND_HZ, Air, Fluid

OMEGA = 2 * np.pi * np.geomspace(*FIT_BAND_HZ, 200)


def test_sensitivities_of_a_fluid_are_its_slopes():
    values = np.array([2.0, 3e3, 8e-6, 0.2, 0.1, 2e-4, 3e-5])

    def responses(logs):
        density, drag, compressibility, *poles = values * np.exp(logs)
        return Fluid(density, drag, compressibility, tuple(poles[:2]), tuple(poles[2:]))

    def slope(n, which, step=1e-4):
        up, down = (
            np.log(responses(sign * step * np.eye(7)[n]).response(OMEGA)[which]) for sign in (1, -1)
        )
        return (up - down) / (2 * step)

    of_density, of_compressibility = responses(np.zeros(7)).sensitivities(OMEGA)
    # Central differences err by the third derivative, of order 1, times step²/6, and by rounding
    # of logarithms of up to 12, eps * 12 / step.
    bound = 1e-8 + np.finfo(float).eps * 12 / 1e-4
    for number, n in enumerate((0, 1)):
        assert np.abs(of_density[number] - slope(n, 0)).max() < bound
    for number, n in enumerate((2, 3, 4, 5, 6)):
        assert np.abs(of_compressibility[number] - slope(n, 1)).max() < bound


def test_scenes_up_to_30_degrees_share_a_time_step_and_hotter_ones_shorten_theirs():
    plans = {
        celsius: build_plan(
            Scene.model_validate(
                {
                    "environment": {"temperature_c": celsius},
                    "numerics": {"dx_mm": 4.7, "scheme": "second"},
                }
            )
        )
        for celsius in (-20.0, 30.0, 60.0)
    }
    # c √3 / (0.99 · 4.7 mm · 44.1 kHz) is 2.95 for c = 349 m/s and 3.09 for c = 366 m/s.
    assert [plans[celsius].steps_per_sample for celsius in plans] == [3, 3, 4]
    for celsius, plan in plans.items():
        assert plan.system.dt * SAMPLE_RATE_HZ * plan.steps_per_sample == pytest.approx(1)
        courant = Air(celsius).sound_speed * np.sqrt(3) * plan.system.dt / 4.7e-3
        assert courant <= 0.99
