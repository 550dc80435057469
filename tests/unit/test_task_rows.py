"""Rows of a task are chosen by truth values or by number."""

import numpy as np

from ajgdata.evaluate.task_data import TaskData


def test_numbers_of_rows_are_no_truth_values_and_all_rows_no_copy():
    names = np.array(["a", "b", "c"])
    rows = TaskData(np.arange(6.0).reshape(3, 2), np.arange(3.0), names, names)
    assert rows.where(np.array([2, 1])).name.tolist() == ["c", "b"]  # none of them is 0
    assert rows.where(np.array([False, True, True])).name.tolist() == ["b", "c"]
    assert rows.where(np.ones(3, bool)) is rows
