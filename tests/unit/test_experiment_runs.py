"""From a store to an experiment's files, and from these to the report and the table of results."""

import csv

import numpy as np
import pytest
from experiment_samples import small_store

from ajgdata.experiments import EXPERIMENTS, Request
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import measurements, read_results, requests_for, run_experiment
from ajgdata.pipeline.exports import collect
from ajgdata.store.features import write_store
from ajgdata.store.tables import write_tables
from ajgdata.types import DatasetSpec

SPLIT = {
    "target": "object", "kind": "classification", "unit": "", "groups": "grasp_id", "folds": 5,
    "withhold": [], "period_deg": None,
}  # fmt: skip
SPEC = DatasetSpec.model_validate(
    {
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
)


def run(paths: Paths, request: Request, **changes) -> None:
    for *_, kind in request.jobs:
        values = {
            "kind": kind, "models": request.job_models[kind], "dataset": "d", "task": "t",
            "split": SPLIT, "settings": request.settings.model_dump(mode="json"), "other_sets": [],
            "audio": SPEC.audio, "features": SPEC.features, "paths": paths, "seed": 3,
            "tables": paths.experiment("d", "t", kind),
            "cost": paths.experiment_cost("d", "t", kind),
        } | changes  # fmt: skip
        run_experiment(paths.features("d"), **values)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    layout = Paths(tmp_path_factory.mktemp("project"))
    write_store(layout.features("d"), small_store())
    for request in requests_for({"d": SPEC}, [("d", "t")]):
        run(layout, request)
    return layout


def collected(paths: Paths) -> tuple[list[dict], list[dict[str, str]], list[dict[str, str]]]:
    requests = requests_for({"d": SPEC}, [("d", "t")])
    about = collect(paths, measurements(paths, requests))
    rows = [
        list(csv.DictReader(path.read_text().splitlines()))
        for path in (paths.metrics_table, paths.predictions)
    ]
    return about, *rows


def test_plain_models_share_a_job_and_others_have_one_each():
    settings = EXPERIMENTS["cross_validation"].settings(models=("cnn", "linear", "svm", "knn"))
    request = Request(EXPERIMENTS["cross_validation"], "d", "t", settings, settings.models)
    shared = {"cross_validation-plain": ["linear", "knn"]}
    own = {f"cross_validation-{model}": [model] for model in ("cnn", "svm")}
    assert request.job_models == shared | own
    assert request.job_settings("cross_validation-plain")["models"] == ["linear", "knn"]


def test_results_of_earlier_versions_are_reported_and_not_read(paths, tmp_path, capsys):
    (request,) = requests_for({"d": SPEC}, [("d", "t")])[:1]
    earlier = Paths(tmp_path)
    write_tables(earlier.experiment(*request.jobs[0]), [], model="linear_plain")
    write_tables(earlier.experiment_cost(*request.jobs[0]), [])
    assert measurements(earlier, [request]) == {}
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == len(request.jobs[:1]) == 1
    file = earlier.experiment(*request.jobs[0])
    problem = "has no key `measurements`, so another version of ajgdata wrote it"
    assert printed[0] == f"{file}: {problem}. Run `ajgdata run`, which computes it again."
    assert [*measurements(paths, [request])] == request.keys


def test_a_task_that_lacks_what_an_experiment_needs_is_skipped_with_the_reason(paths):
    *_, curve = (job for job in requests_for({"d": SPEC}, [("d", "t")]) if "curve" in job.kinds[0])
    results, skipped = read_results(measurements(paths, [curve]), curve, {"d": SPEC}, {})
    assert results.results == ()
    ((label, reason),) = skipped
    assert label == "k-NN"
    assert "99 training groups per class" in reason


def test_a_refused_test_set_of_a_cross_validation_is_listed_with_the_reason(paths):
    request = requests_for({"d": SPEC}, [("d", "t")])[0]
    available = measurements(paths, [request])
    key = request.keys[0]
    results, reasons = read_results(available, request, {"d": SPEC}, {})
    refused = {**available[key].about, "others": {"the test on e": "it contains copies"}}
    available[key] = available[key]._replace(about=refused)
    again, more_reasons = read_results(available, request, {"d": SPEC}, {})
    assert len(again.results) == len(results.results) > 0
    label = again.results[0].label
    assert more_reasons == [*reasons, (f"{label}, the test on e", "it contains copies")]


def test_every_number_has_a_row_with_its_seed_and_what_made_it(paths):
    about, rows, predictions = collected(paths)
    linear = [r for r in rows if r["model"] == "linear_plain" and r["part"] == "grouped"]
    values = {r["statistic"]: float(r["value"]) for r in linear if r["metric"] == "accuracy"}
    folds = [values[f"fold {n}"] for n in range(5)]
    assert values["mean"] == pytest.approx(np.mean(folds), abs=1e-15)
    assert values["sd"] == pytest.approx(np.std(folds, ddof=1), abs=1e-15)
    assert {(r["source"], r["seed"]) for r in rows} == {("simulated", "3")}
    assert any(r["part"] == "cost of grouped" and r["statistic"] == "measured" for r in rows)
    keys = [tuple(v for k, v in row.items() if k != "value") for row in rows]
    assert len(set(keys)) == len(keys)
    once = [p for p in predictions if p["split"] == "grouped"]  # so few are split again as well
    assert len(once) == 60
    right = np.mean([p["y_true"] == p["y_pred"] for p in once])
    assert right == pytest.approx(values["pooled"])
    kinds = {entry["experiment"] for entry in about}
    assert kinds == {"cross_validation", "learning_curve"}
