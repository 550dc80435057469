"""Any scene that can be is stable: drawn at random, struck, marched."""

import numpy as np
from drawn import SCENES
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from ajgdata.gripper import Scene, SceneError, build_plan, simulate
from ajgdata.gripper.object_materials import MATERIALS
from ajgdata.gripper.solver import at_rest, march
from ajgdata.studies.discrete_energy import energies

MATERIAL = st.sampled_from(sorted(MATERIALS)) | st.fixed_dictionaries(
    {
        "density_kg_m3": st.floats(-4, 11).map(lambda e: 10**e),
        "young_pa": st.floats(0, 15).map(lambda e: 10**e),
        "poisson": st.floats(-0.9, 0.49),
        "loss": st.floats(0, 1),
    }
)
MEMBRANE = st.fixed_dictionaries(
    {
        "mass_kg_m2": st.just(0.0) | st.floats(-9, 6).map(lambda e: 10**e),
        "resistance_pa_s_m": st.just(0.0) | st.floats(-6, 15).map(lambda e: 10**e),
        "stiffness_n_m3": st.just(0.0) | st.floats(0, 15).map(lambda e: 10**e),
    }
)
ENVIRONMENT = st.fixed_dictionaries(
    {"temperature_c": st.floats(-20, 60), "pressure_pa": st.floats(5e4, 1.1e5)}
)
NUMERICS = {"dx_mm": 6.0, "cfl": 0.99, "tolerance": 0.0}


def _built(parts, material, membrane, environment, **numerics):
    """The scene with everything else drawn too, or None if it is refused."""
    if isinstance(parts["object"], dict):
        parts = {**parts, "object": {**parts["object"], "material": material}}
    if isinstance(parts.get("gripper"), dict):
        parts = {**parts, "gripper": {**parts["gripper"], "membrane": membrane}}
    parts = {**parts, "environment": environment, "numerics": {**NUMERICS, **numerics}}
    try:
        return build_plan(Scene.model_validate(parts))
    except (ValidationError, SceneError):
        return None


def few(examples):
    return settings(
        max_examples=examples,
        derandomize=True,
        phases=[Phase.generate],  # each example costs a compilation: no shrinking
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
    )


@few(20)
@given(SCENES, MATERIAL, MEMBRANE, ENVIRONMENT, st.integers(0, 2**32 - 1))
def test_energy_never_grows_once_the_source_is_silent(parts, material, membrane, environment, seed):
    plan = _built(parts, material, membrane, environment, precision="float64")
    assume(plan is not None)
    state = at_rest(plan.system)
    noise = np.random.default_rng(seed).standard_normal(60)
    march(plan.system, state, plan.speaker, plan.microphone, noise, 60)
    energy = energies(plan.system, state, 120)
    assert energy[0] > 0
    assert np.all(np.isfinite(energy))
    # What rounding may add: a few ulps of the energy, however it is shared out.
    assert np.all(np.diff(energy) <= 16 * np.finfo(float).eps * energy[:-1])


@few(6)
@given(SCENES, MATERIAL, MEMBRANE, ENVIRONMENT)
def test_responses_are_finite_and_die_away(parts, material, membrane, environment):
    plan = _built(parts, material, membrane, environment, max_time_s=0.03)
    assume(plan is not None)
    samples = simulate(plan).samples
    assert np.all(np.isfinite(samples))
    assert np.abs(samples).max() > 0
