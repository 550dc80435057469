"""Any scene either has a cavity that keeps every promise, or is refused with a reason."""

import numpy as np
import pytest
from drawn import SCENES
from hypothesis import HealthCheck, given, settings
from pydantic import ValidationError

from ajgdata.gripper import Scene, SceneError
from ajgdata.gripper.geometry import RASTER_M, cavity

DRAWN = settings(
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)


def _scene_or_none(given):
    """The scene; None if it is refused by name: no other exception may come."""
    try:
        return Scene.model_validate(given)
    except ValidationError:
        return None


def _grains(scene, surface, floor, roof):
    if scene.medium.kind == "air":
        return 0.0
    return np.sum(np.clip(np.minimum(surface, roof) - floor, 0, None)) * RASTER_M**2


@settings(DRAWN, max_examples=40)
@given(SCENES)
def test_a_drawn_scene_has_a_sound_cavity_or_a_reason(given):
    scene = _scene_or_none(given)
    if scene is None:
        return
    try:
        found = cavity(scene)
    except SceneError as refusal:
        assert len(str(refusal)) < 200 and "\n" not in str(refusal)
        return
    gripper = scene.gripper
    for field in (found.floor, found.roof, found.surface, found.contact, found.held):
        assert np.all(np.isfinite(field))
    assert np.all(found.floor <= found.surface)
    assert np.all(found.surface <= np.maximum(found.roof, found.floor))
    for share in (found.contact, found.held):
        assert share.min() >= 0 and share.max() <= 1
    # Found to within brentq's 1 nm of height, over the area of the rim.
    area = np.pi * (gripper.rim_radius_mm * 1e-3) ** 2
    if scene.object is not None:
        assert found.table_m <= 0
        goal = found.force_n / gripper.stiffness_n_m3
        assert found.displaced_m3 == pytest.approx(goal, abs=2e-9 * area, rel=1e-9)
    radius = np.hypot(*np.meshgrid(found.axis, found.axis)) / (gripper.rim_radius_mm * 1e-3)
    free = -gripper.balloon_depth_mm * 1e-3 * np.sqrt(np.clip(1 - radius**2, 0, None))
    level = (gripper.bed_depth_mm - gripper.balloon_depth_mm) * 1e-3
    poured = _grains(scene, np.full_like(free, level), free, found.roof)
    kept = _grains(scene, found.surface, found.floor, found.roof)
    assert kept == pytest.approx(poured, abs=2e-9 * area, rel=1e-9)
    clearance = gripper.clearance_mm * 1e-3
    above_rim = (found.contact > 0.5) & (found.floor > 0)
    assert np.all((found.roof - found.floor)[above_rim] >= clearance)
    assert found.surface.max() <= gripper.height_mm * 1e-3 - clearance
