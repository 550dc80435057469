"""Selection of the CNN's settings: which recordings it uses, and its differences."""

import numpy as np
import pytest
from experiment_samples import small_store

from ajgdata.evaluate.splits import grouped_folds
from ajgdata.evaluate.task_data import task_data
from ajgdata.store.features import write_store
from benchmarks.cnn_settings import OUTER_FOLDS, InnerResult, changes, inner_result, training_part


def test_the_selection_uses_no_grasp_of_the_outer_test_part(tmp_path):
    store = small_store()
    write_store(tmp_path / "made.nc", store)
    every = task_data(store, "object", "classification", "grasp_id")
    folds = grouped_folds(every.value, every.group, "classification", OUTER_FOLDS, seed=0)
    train, test = folds[0]
    chosen = training_part(tmp_path / "made.nc", "object")
    assert set(chosen.name) == set(every.name[train])
    assert not set(chosen.group) & set(every.group[test])


def test_an_inner_result_predicts_each_recording_once_per_seed(tmp_path):
    write_store(tmp_path / "made.nc", small_store())
    data = training_part(tmp_path / "made.nc", "object")
    result = inner_result(data, "cnn", {"epochs": 1, "min_steps": 10})
    assert result.fits.shape == (12,)  # four folds, three seeds
    assert result.grasps.shape == (len(np.unique(data.group)),)
    wrong = 6 * result.grasps  # of two recordings and three seeds
    np.testing.assert_allclose(wrong, np.round(wrong), atol=1e-9)


def test_a_difference_is_paired_by_grasp():
    """Two grasps with differences 0.1 and 0.3: mean 0.2, standard error 0.1414 / sqrt(2) = 0.1."""
    fits = np.array([0.1, 0.3])
    reference = InnerResult(fits, np.array([0.1, 0.5]), 1.0)
    changed = InnerResult(fits, np.array([0.2, 0.8]), 2.0)
    assert changed.row(reference) == "50.0%\t14.1%\t+20.0% ± 10.0%\t2.00"


def test_changes_are_settings_with_one_value_each():
    assert list(changes(["epochs=5,20", "channels=(4, 4)"])) == [
        ("epochs", 5),
        ("epochs", 20),
        ("channels", (4, 4)),
    ]
    names = {name for name, _ in changes([])}
    assert {"dropout", "weight_decay", "max_learning_rate", "epochs"} <= names
    with pytest.raises(ValueError, match="malformed"):
        list(changes(["epochs=five"]))
