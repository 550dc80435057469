"""Variants with hypotheses: their data, tests, verdicts, and how the report uses them."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from experiment_samples import small_store

from ajgdata.acquire.changed_grasps import NUISANCES, nuisances
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import task_data
from ajgdata.experiments.hypotheses import (
    grid_table,
    hypothesis_table,
    reasons_of,
    with_verdicts,
)
from ajgdata.experiments.requests import requests_for, without_late
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import VariantsSettings
from ajgdata.features.spectrum import settings_text
from ajgdata.gripper.scene import Nuisance
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.report import build_report
from ajgdata.report.studies import figures_of, smallest_changes
from ajgdata.store.features import text_column, write_store
from ajgdata.store.files import read_model
from ajgdata.store.findings import write_findings
from ajgdata.store.labels import take_rows
from ajgdata.store.provenance import software
from ajgdata.store.sessions import read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types import AudioSettings, DataError, FeatureSettings
from ajgdata.types.table import Table, table_of
from ajgdata.types.variants import Variants

CLAIM = {"claim": "it helps", "change": "other training", "explains": ["size", "noise"]}
SETTINGS = {
    "title": "Edge length",
    "question": "Does it help?",
    "train": "made",
    "task": "size",
    "variants": {"plain": {}, "changed": {"split": "random"}},
    "hypotheses": [CLAIM | {"before": "plain", "after": "changed"}],
}


def measured(paths: Paths, name: str, file: Variants) -> Table:
    """Return the scores of a file, measured by its job."""
    spec = read_dataset(paths, file.train)
    settings = VariantsSettings(files={name: file})
    tables = paths.experiment(file.train, file.task, "variants", name)
    run_experiment(
        paths.features(file.train),
        dataset=file.train,
        task=file.task,
        experiment="variants",
        parts=[name],
        settings=settings.model_dump(mode="json"),
        task_settings=spec.task_settings(file.task),
        other_tasks={task: spec.task_settings(task) for task in file.tasks},
        other_sets=[*settings.test_on, *settings.train_on],
        audio=spec.audio,
        features=spec.features,
        paths=paths,
        seed=0,
        tables=tables,
        cost=paths.experiment_cost(file.train, file.task, "variants", name),
        rendered="recipe",
    )
    ((about, (scores,)),) = read_measurements(tables)
    assert "skipped" not in about
    return scores


def test_nuisances_scale_what_differs_between_grasps_and_nothing_else():
    base = Nuisance(grain_force=Variation().grasp.grain_force)
    assert set(NUISANCES) == {n for n in Nuisance.model_fields if "correlation" not in n}
    assert Nuisance(**nuisances(1)) == base
    assert set(nuisances(0).values()) == {0}


def test_variants_are_evaluations_of_the_same_grasps(tmp_path):
    """Joined data sets, a split by recording, one recording per grasp, a band, another model."""
    paths = Paths(tmp_path)
    store = small_store()
    settings = settings_text(AudioSettings(), FeatureSettings())
    store = replace(store, attrs={**store.attrs, "settings": settings})
    store = take_rows(store, np.argsort(store.columns["recording"].values))
    for name in ("here", "there"):
        paths.dataset(name).parent.mkdir(parents=True)
        task = {"target": "object", "folds": 3}
        targets = {"object": {"kind": "classification"}}
        content = {"name": name, "targets": targets, "tasks": {"kind": task}}
        paths.dataset(name).write_text(yaml.safe_dump(content))
        write_store(paths.features(name), store)
    variants = {
        "plain": {},
        "both": {"train": ["here", "there"]},
        "random": {"split": "random", "one_recording": True},
        "band": {"bins_hz": [10, 19]},
        "model": {"model": "linear_plain"},
    }
    hypotheses = [
        CLAIM | {"before": "plain", "after": "random"},
        CLAIM | {"before": "plain", "after": "both", "tested": "there"},
        CLAIM | {"before": "both", "after": "band"},
        CLAIM | {"before": "plain", "after": "model"},
        CLAIM | {"before": "plain", "after": "both", "tested_after": "there"},
    ]
    file = Variants.model_validate(
        {
            "title": "Kind",
            "question": "Which?",
            "train": "here",
            "task": "kind",
            "test": ["there"],
            "models": ["knn_plain"],
            "variants": variants,
            "hypotheses": hypotheses,
        }
    )
    scores = measured(paths, "kinds", file)
    tests = hypothesis_table("kinds", file, scores, "classification", "")
    rows = task_data(store, "object", "classification", "grasp_id")
    rows = rows.where(np.argsort(rows.name))

    def right(feature, value, group, model="knn_plain") -> float:
        result = cross_validate(feature, value, group, kind="classification", model=model, folds=3)
        return float(np.mean(result.scores.per_fold["accuracy"]))

    shares = rows.feature[:, 10:20] / rows.feature[:, 10:20].sum(axis=1, keepdims=True)
    first = np.sort(np.unique(rows.group, return_index=True)[1])
    plain = right(*rows[:3])
    random, both, band, other_model, both_there = tests.numbers("after").tolist()
    # trained on both, every recording is there twice
    assert tests.numbers("before").tolist() == [plain, plain, both, plain, plain]
    assert both_there == both
    assert set(scores.column("test_set")) == {"here", "there", "here+there"}
    assert random == right(rows.feature[first], rows.value[first], None)
    assert band == right(shares, *rows[1:3])
    assert other_model == right(*rows[:3], model="linear_plain")
    assert other_model != plain


def test_the_report_has_a_page_on_causes(tmp_path):
    """Files with hypotheses are on this page, and other files on the page of their task."""
    paths = Paths(tmp_path)
    store = small_store()
    attrs = {"settings": settings_text(AudioSettings(), FeatureSettings()), "inputs_sha256": ""}
    attrs |= software()
    columns = {"session_id": text_column(["s1"] * len(store.feature))}
    store = replace(store, attrs=store.attrs | attrs, columns=store.columns | columns)
    paths.dataset("here").parent.mkdir(parents=True)
    task = {"target": "object", "folds": 3, "models": []}
    targets = {"object": {"kind": "classification"}}
    content = {"name": "here", "targets": targets, "tasks": {"kind": task}}
    paths.dataset("here").write_text(yaml.safe_dump(content))
    write_store(paths.features("here"), store)
    paths.variants.mkdir(parents=True)
    about = {
        "title": "Splits",
        "question": "Which split?",
        "train": "here",
        "task": "kind",
        "models": ["knn_plain"],
        "variants": {"plain": {}, "random": {"split": "random"}},
    }
    hypotheses = {"hypotheses": [CLAIM | {"before": "plain", "after": "random"}]}
    for name, file in {"splits": about, "cause": about | hypotheses}.items():
        (paths.variants / f"{name}.yaml").write_text(yaml.safe_dump(file))
        measured(paths, name, Variants.model_validate(file))
    (request,) = requests_for({"here": read_dataset(paths, "here")}, [("here", "kind")])
    jobs = {job: request.of_job(job[-1]) for job in request.jobs}
    assert [name for *_, name in jobs] == ["cause", "splits"]
    assert [name for *_, name in without_late(jobs)] == ["splits"]
    write_findings(paths.quarantine("here"), [])
    build_report(paths, datasets=["here"], tasks=[("here", "kind")], requested=[])
    page = paths.page("causes").read_text(encoding="utf-8")
    assert "Which split?" in page and "it helps" in page and "not supported" in page
    own = (paths.report.parent / "experiments/here.html").read_text(encoding="utf-8")
    assert 'id="variants--here--kind--splits"' in own
    assert "variants--here--kind--cause" not in own and "causes.html" in own


def test_a_file_that_is_wrong_is_named(tmp_path):
    file = tmp_path / "edges.yaml"
    change = {"hypotheses": [CLAIM | {"before": "plain", "after": "other"}]}
    file.write_text(yaml.safe_dump(SETTINGS | change))
    with pytest.raises(DataError, match="'other' is not a variant") as caught:
        read_model(file, Variants)
    assert str(file) in str(caught.value)
    change = {"hypotheses": [CLAIM | {"before": "plain", "after": "changed", "tested": "far"}]}
    file.write_text(yaml.safe_dump(SETTINGS | change))
    with pytest.raises(DataError, match="'far' is not tested: add it to test"):
        read_model(file, Variants)


BEFORE = (5.0, 5.2, 4.8, 5.1, 4.9)


def trials(*after: float, model: str = "linear", **changes: str) -> Table:
    """The tests of hypotheses whose change makes the error `after`, of which 5 mm is before."""
    names = [f"changed {n}" for n in range(len(after))]
    hypotheses = [{**CLAIM, **changes, "before": "plain", "after": name} for name in names]
    settings = SETTINGS | {"variants": {name: {} for name in ("plain", *names)}}
    folds = {"plain": BEFORE}
    for name, error in zip(names, after, strict=True):
        values = (error + x for x in (0.0, 0.1, -0.1, 0.05, -0.05))
        folds[name] = BEFORE if error == 5 else tuple(values)
    file = Variants.model_validate(settings | {"hypotheses": hypotheses, "models": [model]})
    return hypothesis_table("noise", file, scores_of(folds, model), "regression", "mm")


def scores_of(folds: dict[str, tuple[float, ...]], model: str) -> Table:
    """Return the scores of variants, with an error in mm for each fold."""
    rows = [
        ScoreRow(
            "rmse",
            f"fold {fold}",
            value,
            ScoreKey(model, "grouped", "made", "training", condition=name),
        )
        for name, values in folds.items()
        for fold, value in enumerate(values)
    ]
    return score_table(rows, "Variants")


def test_a_hypothesis_without_results_is_counted():
    file = Variants.model_validate(SETTINGS | {"models": ["linear"]})
    table = hypothesis_table("n", file, scores_of({"plain": BEFORE}, "linear"), "regression", "mm")
    assert table.rows == ()
    assert "1 tests have no results yet: run `snakemake everything`." in table.note


def test_a_trial_has_a_verdict():
    table, worse = with_verdicts([trials(1.0, 9.0, 5.01), trials(9.0, expected="worse")])
    assert table.column("verdict") == ["supported", "refuted", "not supported"]
    assert worse.column("verdict") == ["supported"]
    assert "for the 4 tests on this page (Holm)" in table.note


def test_folds_that_all_differ_alike_are_not_testable_and_do_not_count():
    (table,) = with_verdicts([trials(5.0, 1.0)])
    cells = ("verdict", "gain", "gain_low", "gain_high", "p", "p_holm")
    assert [table.rows[0][key] for key in cells] == ["not testable", 0.0, None, None, None, None]
    assert "for the 1 tests on this page" in table.note
    assert table.rows[1]["p_holm"] == table.rows[1]["p"]


def test_reasons_are_supported_changes_towards_the_paper():
    helps, nothing = reasons_of(with_verdicts([trials(1.0), trials(5.01, claim="nothing")]))
    assert helps.of == ("size", "noise")
    assert helps.link == "causes.html#noise"
    assert [(test.model, test.supported) for test in helps.tests] == [("ridge", True)]
    assert helps.explains(low=False)  # ours is too high, and the change lowers it
    assert not helps.explains(low=True)
    assert not nothing.explains(low=False)


#: A gripper whose planes xz and yz are mirror planes, without random differences.
SYMMETRIC = {
    "gripper": "symmetric",
    "grasp": {"nuisance": nuisances(0)},
    "numerics": {"dx_mm": 6.0},
}


def bars(tmp_path) -> Paths:
    """Return a project with bars at six angles, one of each pair of mirror images withheld."""
    paths = Paths(tmp_path)
    paths.dataset("bars").parent.mkdir(parents=True)
    angles = [15, 45, 75, 105, 135, 165]
    objects = [
        {"name": f"bar_{a}", "shape": "bar", "grasp": {"angle_deg": a}, "targets": {"angle_deg": a}}
        for a in angles
    ]
    task = {"target": "angle_deg", "withhold": [15, 75], "folds": 4}
    content = {
        "name": "bars",
        "targets": {"angle_deg": {"kind": "regression", "unit": "°"}},
        "tasks": {"angle": task, "direction": {**task, "period_deg": 180}},
        "recipe": {"grasps_per_object": 8, "scene": SYMMETRIC, "objects": objects},
    }
    paths.dataset("bars").write_text(yaml.safe_dump(content))
    write_store(paths.features("bars"), small_store())  # not used: all grasps are simulated
    return paths


def test_a_grid_has_the_errors_at_withheld_values_of_all_tasks(tmp_path):
    """k-NN predicts the mirror images: 165° for 15°, and 105° for 75°."""
    content = {
        "title": "Bars",
        "question": "Which?",
        "train": "bars",
        "task": "angle",
        "models": ["knn_plain"],
        "causes": True,
        "shared": {"grasps": {}},
        "axis": "misfit",
        "panel": "target",
        "vary": {
            "target": {"plain": {}, "circle": {"task": "direction"}},
            "misfit": {0: {}},
            # along a mirror plane
            "jig": {10: {"grasps": {"scene": {"session": {"jig_mm": [0, 10]}}}}},
        },
    }
    file = Variants.model_validate(content)
    scores = measured(bars(tmp_path), "bars", file)
    table = grid_table("bars", file, scores, "regression", "°")
    assert [(row["task"], row["x"], row["series"]) for row in table.rows] == [
        ("plain", 0, "10"),
        ("circle", 0, "10"),
    ]
    plain, circle = table.numbers("error")
    assert plain == pytest.approx(np.sqrt((150**2 + 30**2) / 2))
    assert circle == pytest.approx(30)  # both are 30° away, the short way round
    # Training angles of 45°, 105°, 135° and 165° have the mean 112.5°, in folds of almost 6 grasps.
    guess = np.sqrt(((112.5 - 15) ** 2 + (112.5 - 75) ** 2) / 2)
    assert table.rows[0]["chance"] == pytest.approx(guess, rel=0.01)


def test_the_smallest_change_is_the_title_of_the_grid():
    columns = {key: key for key in ("task", "x", "series", "error", "sd", "chance")}
    rows = [
        {"task": task, "x": x, "series": jig, "error": error, "sd": 1.0, "chance": 40.0}
        for task, x, jig, error in (
            ("plain", 0, 0, 39),
            ("plain", 0, 10, 15),
            ("plain", 15, 0, 12),
            ("plain", 15, 10, 9),
            ("circle", 0, 0, 35),
            ("circle", 0, 10, 30),
            ("circle", 15, 0, 30),
            ("circle", 15, 10, 25),
        )
    ]
    table = table_of("breaking_mirror", "Grid", rows, **columns | {"x": "misfit (mm)"})
    assert smallest_changes(table) == (
        "Below half of the chance level: plain with jig 10 mm (15°); circle with no change"
    )
    (shown,) = figures_of("causes", [table])
    assert shown.title == smallest_changes(table)
    assert len(shown.draw().axes) == 2
