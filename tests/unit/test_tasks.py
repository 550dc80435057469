"""What a task may declare."""

import numpy as np
import pytest
from pydantic import ValidationError

from ajgdata.evaluate.task_data import frequent_classes
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureRows, text_column
from ajgdata.types import DatasetSpec, NotPossibleError, Task


def spec(kind: str, **task: object) -> DatasetSpec:
    content = {
        "name": "d",
        "targets": {"x": {"kind": kind}},
        "tasks": {"t": {"target": "x", **task}},
    }
    return DatasetSpec.model_validate(content)


@pytest.mark.parametrize("key", [{"withhold": [1, 2]}, {"period_deg": 180}])
def test_what_is_for_numbers_is_refused_for_classes(key):
    settings = spec("regression", **key).task_settings("t")
    assert settings.model_dump(mode="json").items() >= key.items()
    with pytest.raises(ValidationError, match=f"task t: {next(iter(key))} is not for a"):
        spec("classification", **key)


def test_a_task_may_be_about_some_of_the_classes():
    task = spec("classification", classes=["a", "b"])
    assert task.task_settings("t").classes == task.training("t").classes == ("a", "b")
    assert spec("classification").training("t").classes == ()
    with pytest.raises(ValidationError, match="lists one twice"):
        spec("classification", classes=["a", "b", "a"])


def test_a_model_is_trained_once_for_tasks_with_equal_settings():
    """The number of folds does not change a final model."""
    tasks = {
        "a": {"models": ["knn", "svm"]},
        "folds": {"models": ["cnn", "knn"], "folds": 3},
        "few": {"models": ["knn"], "min_groups": 2},
        "last": {"models": ["cnn", "knn", "svm"]},
    }
    content = {"name": "d", "targets": {"x": {"kind": "classification"}}}
    content["tasks"] = {name: {"target": "x", **task} for name, task in tasks.items()}
    several = DatasetSpec.model_validate(content)
    equal = {
        (task, model): several.equal_training(task, model)
        for task, settings in several.tasks.items()
        for model in settings.models
    }
    assert {key: task for key, task in equal.items() if task} == {
        ("folds", "knn"): "a",
        ("last", "cnn"): "folds",
        ("last", "knn"): "a",
        ("last", "svm"): "a",
    }


@pytest.mark.parametrize(
    ("models", "model"),
    [(["knn", "cnn"], "cnn"), (["svm", "knn"], "svm"), ([], "cnn")],
)
def test_the_model_of_a_command_that_names_none(models, model):
    assert spec("classification", models=models).default_model("t") == model


def test_the_papers_figures_by_part():
    assert Task(target="x", paper="ycb").papers == {"known": "ycb"}
    assert Task(target="x").papers == {}
    parts = {"known": "size-known", "unknown": "size-unknown", "overall": "size"}
    assert Task(target="x", paper=parts, withhold=(1.0,)).papers == parts
    with pytest.raises(
        ValidationError, match=r"paper.overall is not a part of this task: it has known"
    ):
        Task(target="x", paper=parts)


def test_an_experiment_may_have_several_published_values():
    several = {"sorting": "a", "sorting.correct": "b"}
    assert Task(target="x", experiments={"sorting": {}}, paper=several).papers == several
    with pytest.raises(ValidationError, match=r"paper.sorting is not a part of this task"):
        Task(target="x", paper=several)


def test_rare_classes_may_be_left_out_and_are_told():
    with pytest.raises(ValidationError, match="task t: min_groups is not for a regression"):
        spec("regression", min_groups=2)
    assert spec("classification", min_groups=2).training("t").min_groups == 2
    label = ["a"] * 4 + ["b"] * 4 + ["c"] * 2 + [""]
    group = [f"g{n // 2}" for n in range(10)] + ["g9"]  # two grasps each of a and b, one of c
    columns = {"label": text_column(label), "grasp_id": text_column(group)}
    shard = FeatureRows(
        np.ones((11, 2), np.float32), (frequency_axis(np.arange(2.0)),), columns, {}
    )
    named = shard, "label", "grasp_id"
    assert frequent_classes(*named, (), 2) == (["a", "b"], {"c": 1})
    assert frequent_classes(*named, (), 1) == (["a", "b", "c"], {})
    assert frequent_classes(*named, ("b", "a"), 2) == (["b", "a"], {})
    with pytest.raises(NotPossibleError, match="min_groups 3 leaves fewer than two classes"):
        frequent_classes(*named, (), 3)
