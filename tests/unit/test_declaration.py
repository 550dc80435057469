"""What only other files tell of a declaration: said before any work, with a fix."""

import json
from dataclasses import replace

import pytest
import yaml
from experiment_samples import small_store

from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.validate import validate_dataset
from ajgdata.store.features import write_store
from ajgdata.store.sessions import write_session
from ajgdata.types import (
    AudioSettings,
    DataError,
    FeatureSettings,
    Recording,
    Session,
    TaskSettings,
)

TARGETS = {"label": {"kind": "classification"}}


def declare(paths: Paths, name: str, *sessions: str, **keys) -> Paths:
    """A data set whose sessions hold one recording each, with a label and the day."""
    paths.dataset(name).parent.mkdir(parents=True, exist_ok=True)
    paths.dataset(name).write_text(yaml.safe_dump({"name": name, "targets": TARGETS, **keys}))
    for session in sessions:
        row = Recording(
            recording_id="1", file="audio/1.wav", grasp_id="1", labels={"label": "a", "day": "2"}
        )
        write_session(
            paths.session(name, session), Session(session_id=session, source="import"), [row]
        )
    return paths


def task(**keys) -> dict:
    return {"t": {"target": "label", **keys}}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"tasks": task(test_on=["nope"])}, "task t: needs 'nope', no such data set"),
        ({"tasks": task(test_on=["a"])}, "task t: needs 'a', the data set itself"),
        ({"tasks": task(paper="nope")}, "task t: the paper has no figure 'nope'"),
    ],
)
def test_mistakes_of_a_declaration_are_found_by_validate_and_by_a_run(tmp_path, keys, said):
    paths = declare(Paths(tmp_path), "a", "s1", "s2", **keys)
    findings = validate_dataset(paths, "a")[1]
    (wrong,) = (f for f in findings if f.code == "declaration")
    assert (wrong.level, wrong.session_id) == ("error", "dataset.yaml")
    assert wrong.problem.startswith(said) and wrong.fix
    with pytest.raises(DataError, match=r"dataset\.yaml: .*\. [A-Z]") as caught:
        plan(paths, check=True)
    assert said in str(caught.value)


def test_stores_that_do_not_compare_are_refused_when_they_are_read(tmp_path):
    """Also those of a project that nobody planned."""
    shard = small_store()
    for name, rate_hz in (("a", 44_100), ("b", 48_000)):
        content = {"audio": {"sample_rate_hz": rate_hz}, "features": {}}
        attrs = {**shard.attrs, "settings": json.dumps(content)}
        write_store(Paths(tmp_path).features(name), replace(shard, attrs=attrs))
    settings = EXPERIMENTS["cross_validation"].settings(models=["ridge"], test_on=["b"])
    with pytest.raises(DataError, match="do not compare") as caught:
        run_experiment(
            Paths(tmp_path).features("a"),
            experiment="cross_validation",
            parts=["ridge"],
            dataset="a",
            task="t",
            settings=settings.model_dump(mode="json"),
            other_sets=["b"],
            task_settings=TaskSettings(
                target="object", kind="classification", unit="", groups="grasp_id", folds=3
            ),
            audio=AudioSettings(),
            features=FeatureSettings(),
            paths=Paths(tmp_path),
            seed=0,
            tables=tmp_path / "t.json",
            cost=tmp_path / "c.json",
        )
    assert str(Paths(tmp_path).features("b")) in caught.value.where
    assert "48000" in str(caught.value)
