"""Extreme settings: a value beyond the valid range is refused with one line, a bound works."""

import numpy as np
import pytest
from pydantic import ValidationError

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.solver import at_rest, march

STEEL = {"density_kg_m3": 7850.0, "young_pa": 2e11, "poisson": 0.3, "loss": 0.0}
CUBE = {"kind": "cube", "edge_mm": 20.0}


def material(**numbers):
    return {"object": {**CUBE, "material": {**STEEL, **numbers}}}


def membrane(**numbers):
    return {"gripper": {"membrane": numbers}}


def plate(height_mm):
    return {"object": {"kind": "box", "length_mm": 20.0, "width_mm": 20.0, "height_mm": height_mm}}


def session(celsius, offset):
    return {"environment": {"temperature_c": celsius}, "session": {"temperature_k": offset}}


def packed(porosity):
    return {"medium": {"porosity": porosity}, "grasp": {"nuisance": {"packing": 0.01}}}


#: Settings by name: a scene at each bound of the valid range, and one beyond it.
RANGES = {
    "density": (material, "density_kg_m3", (1e-6, 1e12), (0.0, 1e-7, 1e13)),
    "Young's modulus": (material, "young_pa", (1e-6, 1e18), (0.0, 1e-7, 1e19)),
    "mass of the membrane": (membrane, "mass_kg_m2", (0.0, 1e9), (-1.0, 1e10)),
    "resistance of the membrane": (membrane, "resistance_pa_s_m", (0.0, 1e15), (-1.0, 1e16)),
    "tension of the membrane": (membrane, "stiffness_n_m3", (0.0, 1e-6, 1e15), (-1.0, 1e-7, 1e16)),
    "film of air": (membrane, "film", (0.0, 20.0), (-0.1, 21.0)),
}
SCENES = {
    "porosity": (map(packed, (0.2, 0.95)), map(packed, (0.19, 0.96, 1.0))),
    "packing without grains": ((), ({"medium": {"porosity": 0.95}},)),
    "diameter of the grains": (
        ({"medium": {"grain_diameter_mm": mm}} for mm in (0.05, 20.0)),
        ({"medium": {"grain_diameter_mm": mm}} for mm in (0.0, 0.04, 21.0)),
    ),
    "temperature": (
        ({"environment": {"temperature_c": celsius}} for celsius in (-20.0, 60.0)),
        ({"environment": {"temperature_c": celsius}} for celsius in (-20.1, 60.1)),
    ),
    "temperature of a session": (
        (session(55.0, 5.0), session(-10.0, -10.0)),
        (session(55.0, 5.1), session(-10.0, -10.1)),
    ),
    "pressure": (
        ({"environment": {"pressure_pa": pascal}} for pascal in (5e4, 1.1e5)),
        ({"environment": {"pressure_pa": pascal}} for pascal in (0.0, 4.9e4, 1.11e5)),
    ),
    "admittance of the housing": (
        ({"gripper": {"wall_admittance": ratio}} for ratio in (0.0, 1e6)),
        ({"gripper": {"wall_admittance": ratio}} for ratio in (-1.0, 1e7)),
    ),
    "port": (
        ({"gripper": {"port_length_mm": mm}} for mm in (1e-9, 1e6)),
        ({"gripper": {"port_length_mm": mm}} for mm in (0.0, 1e300)),
    ),
    "force": (
        ({"grasp": {"force_n": newton}} for newton in (1e-3, 40.0)),
        ({"grasp": {"force_n": newton}} for newton in (0.0, 1e-300, 41.0)),
    ),
    "height of an object": (map(plate, (1e-6, 1000.0)), map(plate, (0.0, 1e-300, 1001.0))),
    "Courant number": (
        ({"numerics": {"cfl": ratio}} for ratio in (0.01, 0.999)),
        ({"numerics": {"cfl": ratio}} for ratio in (0.0, 1e-9, 1.0)),
    ),
    "grid": (({"numerics": {"dx_mm": 6.0}},), ({"numerics": {"dx_mm": mm}} for mm in (0.7, 6.1))),
    **{
        name: (
            [build(**{key: number}) for number in valid],
            [build(**{key: number}) for number in invalid],
        )
        for name, (build, key, valid, invalid) in RANGES.items()
    },
}
VALID, INVALID = (
    [
        pytest.param(parts, id=f"{name} {number}")
        for name, sides in sorted(SCENES.items())
        for number, parts in enumerate(sides[side])
    ]
    for side in (0, 1)
)
NOT_NUMBERS = [material(young_pa=np.inf), membrane(stiffness_n_m3=np.nan), packed(np.nan)]


@pytest.mark.parametrize("parts", [*INVALID, *NOT_NUMBERS])
def test_a_value_beyond_the_valid_range_is_refused_with_one_line(parts):
    with pytest.raises(ValidationError) as refused:
        Scene.model_validate(parts)
    (error,) = refused.value.errors()
    assert "\n" not in error["msg"] and len(error["msg"]) > 20


@pytest.mark.parametrize("parts", VALID)
def test_a_bound_of_the_valid_range_can_be_marched(parts):
    numerics = {"dx_mm": 6.0, **parts.get("numerics", {})}
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        plan = build_plan(Scene.model_validate({**parts, "numerics": numerics}))
    state = at_rest(plan.system)
    pressure = march(plan.system, state, plan.speaker, plan.microphone, np.ones(1), 200)
    assert np.isfinite(pressure).all() and np.abs(pressure).max() > 0
