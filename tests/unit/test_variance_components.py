"""Components of variance: planted ones are found, exactly where nothing is random."""

import numpy as np
import pytest

from ajgdata.evaluate.variance_components import balanced, variance_components
from ajgdata.types import NotPossibleError

#: A mean feature of unit length: variances are then relative to 1.
MEAN = np.array([0.6, 0.8])


def planted(shape, effects, seed=0):
    """Features of the shape (objects, sessions, grasps, recordings) whose parts are random."""
    rng = np.random.default_rng(seed)
    total = np.zeros((*shape, 2))
    for axes, sd in effects:
        of = [size if axis in axes else 1 for axis, size in enumerate(shape)]
        total = total + sd * rng.standard_normal((*of, 2))
    return MEAN + total - total.mean((0, 1, 2, 3))


def test_deviations_that_are_given_are_found_exactly():
    """±d of two levels have the variance 2 d² (ddof 1), and take of what is above them what
    they add to its means."""
    d = np.array([-1.0, 1.0])
    first = np.array([1.0, 0.0])
    shape = (2, 2, 2, 2)
    for axis, name in ((0, "object"), (1, "session"), (2, "grasp"), (3, "recording")):
        along = d.reshape([2 if a == axis else 1 for a in range(4)])
        # Nested in what is above: the same deviation everywhere would be crossed with it.
        given = MEAN + 0.1 * np.broadcast_to(along[..., None], (*shape, 1)) * first
        found = variance_components(given)._asdict()
        assert found.pop(name) == pytest.approx(2 * 0.1**2, rel=1e-12)
        assert max(found.values()) <= 1e-17


def test_an_object_that_one_session_makes_another_is_neither_object_nor_session():
    swapped = np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None, None, None] * [0.1, 0.0]
    found = variance_components(MEAN + np.broadcast_to(swapped, (2, 2, 3, 2, 2)))
    # one degree of freedom: Σ d² = 4 · 0.01
    assert found.object_in_session == pytest.approx(0.04)
    assert max(found.object, found.session, found.grasp, found.recording) < 1e-17


def test_planted_components_are_found_in_many():
    """A variance of f degrees of freedom errs by √(2/f), here of two bins; 5 of these, and of the
    one below, of which it is cleared."""
    shape = (40, 40, 4, 3)
    sd = {"object": 0.5, "session": 0.4, "object_in_session": 0.3, "grasp": 0.2, "recording": 0.1}
    axes = ((0,), (1,), (0, 1), (0, 1, 2), (0, 1, 2, 3))
    found = variance_components(planted(shape, zip(axes, sd.values(), strict=True)))
    free = {
        "object": 39,
        "session": 39,
        "object_in_session": 39**2,
        "grasp": 4_800,
        "recording": 1e4,
    }
    for name, one in sd.items():
        within = 5 * np.sqrt(2 / (2 * free[name]))
        assert getattr(found, name) == pytest.approx(2 * one**2, rel=1.1 * within)


def test_what_nothing_tells_apart_is_not_known():
    one_session = variance_components(planted((5, 1, 4, 2), [((0,), 0.5), ((0, 1, 2), 0.2)]))
    assert np.isnan(one_session.session) and np.isnan(one_session.object_in_session)
    assert one_session.object > one_session.grasp > 0
    one_each = variance_components(planted((5, 3, 4, 1), [((0,), 0.5), ((0, 1, 2), 0.2)]))
    assert np.isnan(one_each.recording) and one_each.grasp > 0


def test_balanced_takes_what_all_have_by_name():
    rows = [
        (o, s, f"{s}/{o}_{g}", 100 * o + 10 * g + r + (1000 if s == "b" else 0))
        for o, s, grasps in ((1, "a", 3), (1, "b", 2), (2, "a", 2), (2, "b", 3), (3, "a", 3))
        for g in range(grasps)
        for r in range(3 if g else 2)
    ]
    order = np.random.default_rng(0).permutation(len(rows))
    objects, sessions, grasps, value = (
        np.array(column)[order] for column in zip(*rows, strict=True)
    )
    found = balanced(value.astype(float)[:, None], objects, sessions, grasps)
    assert found.shape == (2, 2, 2, 2, 1)  # the third object has no session b
    assert set(found[0, 0, 0].ravel()) == {100, 101}
    assert set(found[1, 1, 1].ravel()) <= {1210, 1211, 1212}
    left = value != 101  # a grasp of one recording, beside two of more
    cut = balanced(value[left, None], objects[left], sessions[left], grasps[left])
    assert cut.shape == (2, 2, 2, 2, 1)
    assert set(cut[0, 0].ravel()) < {110, 111, 112, 120, 121, 122}
    with pytest.raises(NotPossibleError, match="two objects with two grasps each"):
        balanced(value[:, None], objects, np.array(["only", *sessions[1:]]), grasps)
