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
    "cube": [2017.3904, 2101124.5, 20351412.0, 50936697.0, 12.141637],
    "ball in a dish": [2032.0612, 2164728.1, 20981136.0, 47158665.0, 11.130855],
    "plate on a rim": [1974.2192, 2308930.1, 20553338.0, 51181250.0, 9.8283948],
    "metal grains": [1986.1538, 2941145.9, 18516875.0, 47275840.0, 8.5345811],
    "hollow ball": [2047.3657, 2144383.9, 20982926.0, 47613103.0, 11.218542],
    "banana in coffee": [3716.5065, 1556318.1, 10215795.0, 26982467.0, 7.4661353],
    "foam": [1944.5769, 2068842.5, 19895025.0, 50212526.0, 10.260623],
}


@pytest.mark.parametrize("name", SCENES)
def test_a_verified_scene_sounds_as_it_did(name):
    response = simulate(Scene.model_validate({"numerics": NUMERICS, **SCENES[name]}))
    spectrum = np.abs(np.fft.rfft(response.samples, 4096))
    bands = [np.linalg.norm(part) for part in np.split(spectrum, (186, 558))]
    values = [response.static, *bands, np.linalg.norm(response.outside)]
    assert values == pytest.approx(KNOWN[name], rel=1e-6)
