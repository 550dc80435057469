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
    "empty": [2169.6017, 3337958.6, 45535589.0, 157018590.0, 19.021491],
    "cube": [2012.6716, 2127383.9, 20492959.0, 50530607.0, 12.046965],
    "ball in a dish": [2050.5588, 2176639.2, 21175147.0, 46636426.0, 11.015248],
    "plate on a rim": [2010.1194, 2306982.8, 20763145.0, 50938509.0, 9.6972344],
    "metal grains": [2000.3218, 2964271.4, 18624074.0, 47112533.0, 8.4387839],
    "hollow ball": [2062.0245, 2159864.3, 21169587.0, 47206672.0, 11.103538],
    "banana in coffee": [3722.3842, 1561760.0, 10277277.0, 26965734.0, 7.3888316],
    "foam": [1990.0516, 2050514.6, 20096697.0, 49973641.0, 10.134603],
}


@pytest.mark.parametrize("name", SCENES)
def test_a_verified_scene_sounds_as_it_did(name):
    response = simulate(Scene.model_validate({"numerics": NUMERICS, **SCENES[name]}))
    spectrum = np.abs(np.fft.rfft(response.samples, 4096))
    bands = [np.linalg.norm(part) for part in np.split(spectrum, (186, 558))]
    values = [response.static, *bands, np.linalg.norm(response.outside)]
    assert values == pytest.approx(KNOWN[name], rel=1e-6)
