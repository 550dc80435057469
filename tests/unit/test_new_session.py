"""Models in a session they have not met: what each remedy uses, and what it mends."""

import numpy as np
import pytest
from experiment_samples import measured, numbers, small_inputs, task_results

from ajgdata.evaluate.few_grasps import NONE, on_new_sessions
from ajgdata.evaluate.task_data import TaskData, session_of
from ajgdata.store.features import Column, Shard, text_column

BINS, OBJECTS, GRASPS = 60, ("ball", "box", "rod"), 6
SETTINGS = {"grasps": [1, 2, 9], "models": ["knn_plain"], "draws": 2}


def wide(rng: np.random.Generator) -> np.ndarray:
    """Levels that change slowly with frequency, so that a small stretch changes little."""
    return np.repeat(rng.normal(size=BINS // 10), 10)


def store(sessions: int = 3) -> Shard:
    """Six grasps of three objects in each session, with gains of its own that are larger than what
    tells the objects."""
    rng = np.random.default_rng(0)
    shapes = {held: wide(rng) for held in OBJECTS}
    rows, feature = [], []
    for session in range(sessions):
        gain = 3 * wide(rng)
        for held in OBJECTS:
            for n in range(GRASPS):
                rows.append((f"s{session}/{held}{n}", held))
                level = np.exp(shapes[held] + gain + 0.3 * rng.normal(size=BINS))
                feature.append(level / level.sum())
    names = text_column([name for name, _ in rows])
    held = [one for _, one in rows]
    size = [10.0 * OBJECTS.index(one) for one in held]
    columns = {"recording": names, "grasp_id": names, "object": text_column(held)}
    columns["size"] = Column(np.array(size), {"units": "mm"})
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "", "settings": "{}"}
    return Shard(np.array(feature, np.float32), np.arange(float(BINS)), columns, attrs)


@pytest.fixture(scope="module")
def outcome():
    return measured("across_sessions", small_inputs(store=store()), "knn_plain", **SETTINGS)


@pytest.fixture(scope="module")
def results(outcome):
    return task_results("across_sessions", {"knn_plain": outcome}, settings=SETTINGS)


def mean(outcome, remedy: str, metric: str = "accuracy") -> float:
    (value,) = numbers(outcome.tables, part=f"sessions: {remedy}", metric=metric, statistic="mean")
    return value


def test_gains_of_a_session_are_mended_by_what_knows_them(outcome):
    assert mean(outcome, NONE) < 0.7
    assert mean(outcome, "standardised") > mean(outcome, NONE) + 0.1


def test_what_is_used_of_a_session_is_counted_and_the_same_is_tested(outcome):
    measures = outcome.tables[1].where(metric="accuracy")
    told = {r["remedy"]: (r["labelled"], r["unlabelled"]) for r in measures.rows}
    assert told == {
        NONE: (0, 0), "standardised": (0, 6), "1 grasp of each": (3, 0), "2 grasps of each": (6, 0),
    }  # fmt: skip
    assert len(measures.rows) == 3 * 2 * 4
    assert set(measures.column("chance")) == {1 / 3}
    folds = numbers(outcome.tables, part=f"sessions: {NONE}", metric="accuracy", statistic="fold 1")
    by_hand = measures.where(session="s1", remedy=NONE).numbers("value")
    assert folds == [pytest.approx(by_hand.mean())]


def data(**changes) -> TaskData:
    shard = store(2)
    held = shard.columns["object"].values.astype(str)
    names = shard.columns["recording"].values.astype(str)
    return TaskData(shard.feature, held, names, names)._replace(**changes)


def told(given: TaskData):
    """Rows of the accuracy, and of each correction."""
    rows = on_new_sessions(
        given, session_of(given.name), kind="classification", tested=["s1"], train_on=[],
        sizes=[2], draws=1, model="linear_plain", seed=0,
    )  # fmt: skip
    return [row for row in rows if row["metric"] == "accuracy"]


def test_a_group_that_is_tested_is_trained_on_in_no_session():
    """Things that are grasped in both sessions, each known by a bin of its own that tells its
    class: without the thing in the training nobody can know."""
    names = np.array([name[3:] for name in data().group])
    own = np.eye(len(set(names)))[np.unique(names, return_inverse=True)[1]] + 0.01
    found = told(data(feature=own.astype(np.float32), group=names))
    assert found[0]["labelled"] == 0 and found[0]["value"] < 0.7
    leaky = told(data(feature=own.astype(np.float32)))  # two things of two names
    assert leaky[0]["value"] == 1.0
