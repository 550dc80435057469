"""Several looks at an object, and runs over placements."""

import numpy as np
import pytest

from ajgdata.evaluate.sorting import (
    Looked,
    combined,
    look,
    orders,
    run_in_order,
)


def test_looks_are_multiplied():
    assert combined(np.array([[0.5, 0.3, 0.2], [0.2, 0.2, 0.6]])) == pytest.approx(
        np.array([0.10, 0.06, 0.12]) / 0.28
    )
    one = np.array([[0.6, 0.3, 0.1]])
    assert combined(one).tolist() == one[0].tolist()  # to the last bit: 0.6 is enough
    # what one look excludes, however sure, another may bring back only against 1e-12
    assert combined(np.array([[1.0, 0.0], [0.4, 0.6]])).argmax() == 0


UNSURE_THEN_SURE = np.array([[[0.5, 0.5], [0.8, 0.2]], [[0.7, 0.3], [0.1, 0.9]]])


def test_another_look_is_had_while_nothing_is_probable_enough():
    once = look(UNSURE_THEN_SURE, 0.6, 1)
    assert once.taken.tolist() == [-1, 0] and once.looks.tolist() == [1, 1]
    twice = look(UNSURE_THEN_SURE, 0.6, 2)
    assert twice.taken.tolist() == [0, 0] and twice.looks.tolist() == [2, 1]
    assert twice.probability[0] == pytest.approx([0.8, 0.2])
    always = look(UNSURE_THEN_SURE, 0.6, 2, always=True)
    assert always.taken.tolist() == [0, 1] and always.looks.tolist() == [2, 2]
    assert always.probability[1] == pytest.approx(np.array([0.07, 0.27]) / 0.34)


def test_a_run_meets_each_placement_once_and_stops_in_doubt():
    looked = Looked(np.array([0, 1, 0, -1]), np.array([1, 2, 1, 3]), np.zeros((4, 2)))
    label = np.array([0, 1, 1, 0])
    run = run_in_order(looked, label, [1, 2, 0, 3])
    assert (run.sorts, run.mistakes, run.before_error) == (3, 1, 1)
    assert (run.looks, run.stopped_at) == (7, 3)
    at_once = run_in_order(looked, label, [3, 0, 1, 2])
    assert (at_once.sorts, at_once.looks, at_once.stopped_at) == (0, 3, 3)
    sure = Looked(label, np.ones(4, int), np.zeros((4, 2)))
    run = run_in_order(sure, label, [0, 1, 2, 3])
    assert (run.sorts, run.mistakes, run.before_error, run.stopped_at) == (4, 0, 4, None)


def test_orders_are_permutations_that_a_seed_decides():
    first = orders(30, 3, 7)
    assert all(sorted(order.tolist()) == list(range(30)) for order in first)
    assert len({tuple(order) for order in first}) == 3
    again = orders(30, 4, 7)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=False))
