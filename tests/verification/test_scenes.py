"""Whole scenes: what must differ, what must not, and by how much."""

import numpy as np
import pytest

from ajgdata.gripper import Scene, simulate
from ajgdata.gripper.geometry import grasp_cavity
from ajgdata.gripper.grid import cut_cells


def _scene(edge_mm: float | None = 20.0, **parts) -> Scene:
    shape = None if edge_mm is None else {"kind": "cube", "edge_mm": edge_mm}
    numerics = {"dx_mm": 4.0} | parts.pop("numerics", {})
    return Scene.model_validate({"object": shape, "numerics": numerics, **parts})


def test_media_reflect_in_the_order_of_the_paper():
    energy = {}
    for kind in ("plastic", "metal", "coffee", "air"):
        scene = _scene(None, medium={"kind": kind}, numerics={"max_time_s": 0.1, "dx_mm": 5.0})
        energy[kind] = float(np.sum(simulate(scene).samples ** 2))
    shares = [energy[kind] / energy["air"] for kind in ("plastic", "metal", "coffee")]
    assert 0.5 > shares[0] > shares[1] > shares[2] > 0.001
    assert shares[2] < 0.2  # coffee loses more than 80 % (paper)


def test_the_scene_does_not_depend_on_the_grid():
    shape = grasp_cavity(_scene(18.0))
    cells = cut_cells(shape, 3.3e-3, 0.05, -0.045, 0.045)
    pixel = 0.5e-3**2
    open_ = np.sum(np.clip(shape.roof - shape.floor, 0, None)) * pixel
    grains = np.sum(np.clip(np.minimum(shape.surface, shape.roof) - shape.floor, 0, None)) * pixel
    assert cells.volume.sum() == pytest.approx(open_, rel=2e-3)
    assert cells.bed.sum() == pytest.approx(grains, rel=5e-3)
