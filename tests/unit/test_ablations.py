"""Ablations: their settings, changed grasps, verdicts, and how the report uses them."""

import numpy as np
import pytest
import yaml
from experiment_samples import small_store

from ajgdata.ablations import read_ablations, reasons_of, trial_table, with_verdicts
from ajgdata.ablations.measure import NUISANCES, measure, measure_grid, nuisances
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.evaluate.task_data import task_data
from ajgdata.gripper.scene import Nuisance
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.report.studies import figures_of, smallest_changes
from ajgdata.store.features import write_store
from ajgdata.types import DataError
from ajgdata.types.comparison import Ablation
from ajgdata.types.table import Table, table_of

WHY = {"claim": "it helps", "change": "other training", "of": ["size", "noise"]}
SETTINGS = {
    "title": "Edge length",
    "train": "made",
    "task": "size",
    "variants": {"plain": {}, "changed": {"split": "random"}},
    "why": [WHY | {"before": "plain", "after": "changed"}],
}


def test_nuisances_scale_what_differs_between_grasps_and_nothing_else():
    base = Nuisance(grain_force=Variation().grasp.grain_force)
    assert set(NUISANCES) == {n for n in Nuisance.model_fields if "correlation" not in n}
    assert Nuisance(**nuisances(1)) == base
    assert set(nuisances(0).values()) == {0}


def test_variants_are_evaluations_of_the_same_grasps(tmp_path):
    """Joined data sets, a split by recording, one recording per grasp, a band, another model."""
    paths, store = Paths(tmp_path), small_store()
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
        "band": {"band_hz": [10, 19]},
        "model": {"model": "linear_plain"},
    }
    settings = {"title": "Kind", "train": "here", "task": "kind", "test": ["there"],
                "models": ["knn_plain"], "variants": variants, "why": [
                    WHY | {"before": "plain", "after": "random"},
                    WHY | {"before": "plain on:there", "after": "both on:there"},
                    WHY | {"before": "both", "after": "band"},
                    WHY | {"before": "plain", "after": "model"}]}  # fmt: skip
    tests = measure(paths, "kind", Ablation.model_validate(settings), seed=0)
    rows = task_data(store, "object", "classification", "grasp_id")
    rows = rows.where(np.argsort(rows.name))

    def right(feature, value, group, model="knn_plain") -> float:
        result = cross_validate(feature, value, group, kind="classification", model=model, folds=3)
        return float(np.mean(result.scores.per_fold["accuracy"]))

    shares = rows.feature[:, 10:20] / rows.feature[:, 10:20].sum(axis=1, keepdims=True)
    first = np.sort(np.unique(rows.group, return_index=True)[1])
    plain = right(*rows[:3])
    random, both, band, other_model = tests.numbers("after").tolist()
    # trained on both, every recording is there twice
    assert tests.numbers("before").tolist() == [plain, plain, both, plain]
    assert random == right(rows.feature[first], rows.value[first], None)
    assert band == right(shares, *rows[1:3])
    assert other_model == right(*rows[:3], model="linear_plain")
    assert other_model != plain


def test_a_file_that_is_wrong_is_named(tmp_path):
    paths = Paths(tmp_path)
    paths.ablation_settings.mkdir(parents=True)
    file = paths.ablation_settings / "edges.yaml"
    change = {"why": [WHY | {"before": "plain", "after": "other"}]}
    file.write_text(yaml.safe_dump(SETTINGS | change))
    with pytest.raises(DataError, match="'other' is not a variant") as caught:
        read_ablations(paths)
    assert str(file) in str(caught.value)


BEFORE = (5.0, 5.2, 4.8, 5.1, 4.9)


def trials(*after: float, model: str = "linear", **why: str) -> Table:
    """The tests of hypotheses whose change makes the error `after`, of which 5 mm is before."""
    names = [f"changed {n}" for n in range(len(after))]
    hypotheses = [{**WHY, **why, "before": "plain", "after": name} for name in names]
    settings = SETTINGS | {"variants": {name: {} for name in ("plain", *names)}}
    folds = {"plain": BEFORE}
    for name, error in zip(names, after, strict=True):
        values = (error + x for x in (0.0, 0.1, -0.1, 0.05, -0.05))
        folds[name] = BEFORE if error == 5 else tuple(values)
    ablation = Ablation.model_validate(settings | {"why": hypotheses})
    return trial_table("noise", ablation, {model: folds}, "rmse", "mm")


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
    helps, nothing = reasons_of(
        with_verdicts([trials(1.0), trials(5.01, claim="nothing")]), "ablations"
    )
    assert helps.of == ("size", "noise")
    assert helps.link == "ablations.html#noise"
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
    return paths


def test_a_grid_has_the_errors_at_withheld_values_of_all_tasks(tmp_path):
    """k-NN predicts the mirror images: 165° for 15°, and 105° for 75°."""
    grid = {
        "name": "bars",
        "title": "Bars",
        "train": "bars",
        "tasks": {"angle": "plain", "direction": "circle"},
        "model": "knn_plain",
        "x": {"title": "misfit", "unit": "mm", "scenes": {0: {}}},
        "series": {
            "title": "jig",
            "unit": "mm",
            "scenes": {10: {"session": {"jig_mm": [0, 10]}}},  # along a mirror plane
        },
    }
    ablation = Ablation.model_validate(SETTINGS | {"train": "bars", "grid": grid})
    assert ablation.datasets == ("bars",)
    table = measure_grid(bars(tmp_path), ablation, ablation.grid, seed=0)
    assert [(row["task"], row["x"], row["series"]) for row in table.rows] == [
        ("plain", 0, 10),
        ("circle", 0, 10),
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
            ("plain", 0, 0, 39), ("plain", 0, 10, 15), ("plain", 15, 0, 12), ("plain", 15, 10, 9),
            ("circle", 0, 0, 35), ("circle", 0, 10, 30), ("circle", 15, 0, 30),
            ("circle", 15, 10, 25),
        )
    ]  # fmt: skip
    table = table_of("breaking_mirror", "Grid", rows, **columns | {"x": "misfit (mm)"})
    assert smallest_changes(table) == (
        "Below half of the chance level: plain with jig 10 mm (15°); circle with no change"
    )
    (shown,) = figures_of("ablations", [table])
    assert shown.title == smallest_changes(table)
    assert len(shown.draw().axes) == 2
