"""From a store to an experiment's files, and from these to the report and the table of results."""

import csv

import numpy as np
import pytest
import yaml
from experiment_samples import small_store

import ajgdata
from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.experiments.requests import Request, requests_for
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.task_results import measurements, read_results
from ajgdata.store.features import write_store
from ajgdata.store.metrics import KEYS
from ajgdata.store.tables import write_tables
from ajgdata.types import DatasetSpec, TaskSettings

TASK = TaskSettings.model_validate(
    {
        "target": "object",
        "kind": "classification",
        "unit": "",
        "groups": "grasp_id",
        "folds": 5,
        "withhold": [],
        "period_deg": None,
    }
)
DECLARATION = {
    "name": "d",
    "targets": {"object": {"kind": "classification"}},
    "tasks": {
        "t": {
            "target": "object",
            "models": ["linear_plain"],
            "experiments": {
                "learning_curve": {"groups": [1, 99], "models": ["knn"]},
            },
        }
    },
}
SPEC = DatasetSpec.model_validate(DECLARATION)


def run(paths: Paths, request: Request, **changes) -> None:
    for job in request.jobs:
        *_, experiment, models = job
        values = {
            "dataset": "d",
            "task": "t",
            "experiment": experiment,
            "parts": request.of_job(models).part_names,
            "task_settings": TASK,
            "settings": request.settings.model_dump(mode="json"),
            "other_sets": [],
            "audio": SPEC.audio,
            "features": SPEC.features,
            "paths": paths,
            "seed": 3,
            "tables": paths.experiment(*job),
            "cost": paths.experiment_cost(*job),
        } | changes
        run_experiment(paths.features("d"), **values)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    layout = Paths(tmp_path_factory.mktemp("project"))
    write_store(layout.features("d"), small_store())
    for request in requests_for({"d": SPEC}, [("d", "t")]):
        run(layout, request)
    return layout


def test_plain_models_share_a_job_and_others_have_one_each():
    settings = EXPERIMENTS["cross_validation"].settings(models=("cnn", "linear", "svm", "knn"))
    experiment = EXPERIMENTS["cross_validation"]
    parts = tuple(experiment.division.parts(settings))
    request = Request(experiment, "d", "t", settings, parts)
    assert request.part_names == ["cnn", "linear", "svm", "knn"]
    jobs = {name: request.of_job(name) for *_, name in request.jobs}
    names = {name: job.part_names for name, job in jobs.items()}
    assert names == {"cnn": ["cnn"], "plain": ["linear", "knn"], "svm": ["svm"]}
    assert jobs["plain"].job_settings()["models"] == ["linear", "knn"]


def test_results_of_earlier_versions_are_errors_and_not_read(paths, tmp_path):
    (request,) = requests_for({"d": SPEC}, [("d", "t")])[:1]
    earlier = Paths(tmp_path)
    write_tables(earlier.experiment(*request.jobs[0]), [], model="linear_plain")
    write_tables(earlier.experiment_cost(*request.jobs[0]), [])
    available, errors = measurements(earlier, [request])
    assert available == {}
    file = earlier.experiment(*request.jobs[0])
    assert {*errors} == {file, earlier.experiment_cost(*request.jobs[0])}
    problem = "has no key `measurements`, so another version of ajgdata wrote it"
    command = f"ajgdata run d --forcerun {file.relative_to(tmp_path)}"
    assert str(errors[file]) == f"{file}: {problem}. Run `{command}`, which computes it again."
    available, errors = measurements(paths, [request])
    assert [*available] == request.keys
    assert errors == {}


def test_a_task_that_lacks_what_an_experiment_needs_is_skipped_with_the_reason(paths):
    *_, curve = (
        job
        for job in requests_for({"d": SPEC}, [("d", "t")])
        if job.experiment.name == "learning_curve"
    )
    results, skipped = read_results(measurements(paths, [curve])[0], curve, {"d": SPEC}, {})
    assert results.results == ()
    ((label, reason),) = skipped
    assert label == "k-NN"
    assert "99 training groups per class" in reason


def test_a_refused_test_set_of_a_cross_validation_is_listed_with_the_reason(paths):
    request = requests_for({"d": SPEC}, [("d", "t")])[0]
    available, _ = measurements(paths, [request])
    key = request.keys[0]
    results, reasons = read_results(available, request, {"d": SPEC}, {})
    refused = {**available[key].about, "others": {"the test on e": "it contains copies"}}
    available[key] = available[key]._replace(about=refused)
    again, more_reasons = read_results(available, request, {"d": SPEC}, {})
    assert len(again.results) == len(results.results) > 0
    label = again.results[0].label
    assert more_reasons == [*reasons, (f"{label}, the test on e", "it contains copies")]


def test_every_number_has_a_row_with_its_seed_and_what_made_it(paths):
    paths.dataset("d").parent.mkdir(parents=True)
    paths.dataset("d").write_text(yaml.safe_dump(DECLARATION))
    collect(paths, datasets=["d"], tasks=[("d", "t")])
    metrics = ajgdata.load_metrics(project=paths.root)
    linear = metrics.query("model == 'linear_plain' and split == 'grouped'")
    values = linear.query("metric == 'accuracy'").set_index("statistic")["value"]
    folds = [values[f"fold {n}"] for n in range(5)]
    assert values["mean"] == pytest.approx(np.mean(folds), abs=1e-15)
    assert values["sd"] == pytest.approx(np.std(folds, ddof=1), abs=1e-15)
    assert set(metrics["source"]) == {"simulated"} and set(metrics["seed"]) == {3}
    assert set(metrics["experiment"]) == {"cross_validation"}  # the curve was skipped
    assert "train_cpu_s" in set(linear.query("statistic == 'cost'")["metric"])
    assert not metrics.duplicated([*KEYS]).any()
    with paths.predictions.open(encoding="utf-8", newline="") as stream:
        predictions = list(csv.DictReader(stream))
    once = [p for p in predictions if p["split"] == "grouped"]
    assert len(once) == 60
    right = np.mean([p["y_true"] == p["y_pred"] for p in once])
    assert right == pytest.approx(values["pooled"])
