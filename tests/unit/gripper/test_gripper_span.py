"""Spans and arrays keep to whole cache lines, and the numbers do not depend on it."""

from dataclasses import replace

import numpy as np
import pytest

from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.solver import at_rest, march


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
