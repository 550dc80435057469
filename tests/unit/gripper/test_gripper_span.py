"""Spans and arrays keep to whole cache lines, and the numbers do not depend on it."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.grid import LANES, cut_cells
from ajgdata.gripper.solver import at_rest, march
from ajgdata.studies.domains import Region


@pytest.mark.parametrize("scheme", ["wide", "second"])
def test_bounds_of_the_spans_do_not_change_a_byte(scheme):
    scene = Scene.model_validate(
        {"object": {"kind": "cube", "edge_mm": 20}, "numerics": {"dx_mm": 6, "scheme": scheme}}
    )
    plan = build_plan(scene)
    system, heard = plan.system, []
    slabs = np.arange(len(system.span.lo)).astype(np.uint64) * np.uint64(system.span.slab)
    active = np.bincount(np.flatnonzero(system.mass) // system.span.slab, minlength=len(slabs)) > 0
    row = np.uint64(system.span.row)
    wide = system.span._replace(
        lo=np.where(active, slabs + row, slabs),
        hi=np.where(active, slabs + np.uint64(system.span.slab) - row, slabs),
    )
    assert (wide.hi - wide.lo).sum() > (system.span.hi - system.span.lo).sum()
    for span in (system.span, wide):
        marched = replace(system, span=span)
        state = at_rest(marched)
        arguments = (state, plan.speaker, plan.microphone, np.ones(1), 300)
        heard.append(march(marched, *arguments).tobytes())
    assert heard[0] == heard[1]


@pytest.mark.parametrize("half_cells", [4, 9])
def test_a_slab_is_whole_vectors_and_its_rows_are_no_neighbours(half_cells):
    h = 0.004
    # As wide as its grid, so that the last cell of a row is open and so is the first of the next.
    inside = lambda u, v: np.maximum(np.abs(u), np.abs(v)) < half_cells * h  # noqa: E731
    room = Region(lambda u, v: (0.0, np.where(inside(u, v), 5 * h, 0.0), 0.0))
    cells = cut_cells(room, h, half_cells * h, 0.0, 5 * h)
    _, ny, nx = cells.shape
    assert nx == 2 * half_cells
    assert ny * nx % LANES == 0
    assert cells.volume.sum() == pytest.approx((2 * half_cells) ** 2 * 5 * h**3)
    assert cells.area_x[:, :, -1].max() == cells.area_y[:, -1].max() == 0.0
    assert cells.area_x[:, :, :-1].max() == pytest.approx(h**2)
    np.testing.assert_allclose(cells.y, -cells.y[::-1])
    with pytest.raises(ValueError, match="edge of its grid"):
        cut_cells(room, h, (half_cells - 1) * h, 0.0, 5 * h)
