"""Responses of eight scenes as they were when the physics was verified.

A change of these numbers is a change of the physics: raise `PHYSICS_VERSION` and say why in the
changelog. Computers round sums in another order, which changes a norm by about 1e-12.
"""

import numpy as np
import pytest

from ajgdata.gripper import Scene, simulate

NUMERICS = {"dx_mm": 6, "max_time_s": 0.02, "precision": "float64"}
BED = {"history": {"seed": 3, "number": 2, "memory": 0.5}, "nuisance": {"grain_force": 0.22}}
DISH = {"support": {"kind": "concave"}}
SCENES = {
    "empty": {"object": None, "medium": {"kind": "air"}},
    "cube": {"object": "cube_20p7", "grasp": {"angle_deg": 20, **BED}},
    "ball in a dish": {"object": "sphere80_metal", **DISH},
    "plate on a rim": {"object": "plate_wood", **DISH},
    "metal grains": {"object": "plate_plastic", "medium": {"kind": "metal"}},
    "hollow ball": {"object": "orange", "session": {"jig_mm": [2, 1], "temperature_k": 1.5}},
    "banana in coffee": {
        "object": "banana",
        "medium": {"kind": "coffee"},
        "assembly": {"askew_mm": [2, -1], "fill_slope_deg": [1, 2]},
    },
    "foam": {"object": "foam_brick"},
}
#: Static pressure, norms of the spectrum up to 2 kHz, to 6 kHz and above, and of the gain outside.
KNOWN = {
    "empty": [2851.9744, 4251757.8, 45836143.0, 156962430.0, 19.02611],
    "cube": [2017.0048, 2101679.8, 20336099.0, 50888584.0, 12.131737],
    "ball in a dish": [2031.9231, 2165111.7, 20964084.0, 47103239.0, 11.121862],
    "plate on a rim": [1974.3267, 2309155.9, 20534720.0, 51133582.0, 9.820531],
    "metal grains": [1986.6074, 2940229.5, 18481293.0, 47259402.0, 8.5252618],
    "hollow ball": [2046.8828, 2145076.9, 20965442.0, 47558838.0, 11.209461],
    "banana in coffee": [3717.0352, 1556494.1, 10215947.0, 26983264.0, 7.4656472],
    "foam": [1944.9336, 2068672.9, 19878210.0, 50167059.0, 10.252774],
}


@pytest.mark.parametrize("name", SCENES)
def test_a_verified_scene_sounds_as_it_did(name):
    response = simulate(Scene.model_validate({"numerics": NUMERICS, **SCENES[name]}))
    spectrum = np.abs(np.fft.rfft(response.samples, 4096))
    bands = [np.linalg.norm(part) for part in np.split(spectrum, (186, 558))]
    values = [response.static, *bands, np.linalg.norm(response.outside)]
    assert values == pytest.approx(KNOWN[name], rel=1e-6)
