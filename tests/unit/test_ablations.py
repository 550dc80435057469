"""Ablations: the mirror plane, changed grasps, verdicts, and how the report uses them."""

import numpy as np
import pytest
import yaml
from drawn_figures import fits

from ajgdata.ablations import ABLATIONS, ablation, mirror, possible, variance
from ajgdata.ablations.base import Folds, Hypothesis, Trial, reasons_of, trial_table, with_verdicts
from ajgdata.ablations.data import NUISANCES, AblationData, nuisances
from ajgdata.ablations.mirror import DIRECTION, FROM_PLANE, SETUPS
from ajgdata.evaluate import crossval
from ajgdata.gripper.scene import Nuisance
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.pipeline.studies import run_ablation
from ajgdata.report.canvas import draw
from ajgdata.report.study_page import placed_figures
from ajgdata.store.tables import read_tables
from ajgdata.types.table import Table, table_of

DECLARATION = {
    "name": "made",
    "targets": {"edge_mm": {"kind": "regression", "unit": "mm"}},
    "tasks": {"size": {"target": "edge_mm"}},
    "recipe": {
        "sessions": 2,
        "grasps_per_object": 2,
        "vary": {"offset_x_mm": [-4, 4]},
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.004}},
        "objects": [
            {
                "name": f"cube_{edge}",
                "shape": {"kind": "cube", "edge_mm": edge},
                "targets": {"edge_mm": edge},
            }
            for edge in (20, 25)
        ],
    },
}


@pytest.fixture
def data(tmp_path) -> AblationData:
    paths = Paths(tmp_path)
    paths.dataset("made").parent.mkdir(parents=True)
    paths.dataset("made").write_text(yaml.safe_dump(DECLARATION))
    return AblationData(paths)


def test_nuisances_scale_what_differs_between_grasps_and_nothing_else():
    base = Nuisance(grain_force=Variation().grasp.grain_force)
    assert set(NUISANCES) == {n for n in Nuisance.model_fields if "correlation" not in n}
    assert Nuisance(**nuisances(1)) == base
    assert set(nuisances(0).values()) == {0}
    assert nuisances(2, ("force",)) == {
        **dict.fromkeys(NUISANCES, 0),
        "force": 2 * base.force,
    }


def test_the_first_grasps_of_each_object_in_blocks_too(data):
    path = data.paths.dataset("made")
    varied = {**DECLARATION["recipe"], "order": "blocks", "variation": {}}
    path.write_text(yaml.safe_dump(DECLARATION | {"recipe": varied}))
    grasps = data.grasps("made", each=1)
    assert [g.object for g in grasps] == ["cube_20", "cube_25"]
    same, centred = (data.changed("made", "size", grasps, {}, pose=pose) for pose in (1.0, 0.0))
    still = {"offset_x_mm": 0.0, "placed_mm": [0.0, 0.0], "placed_deg": 0.0}
    moved = data.changed("made", "size", grasps, {"grasp": still})
    assert np.array_equal(centred.feature, moved.feature)
    assert not np.array_equal(centred.feature, same.feature)


def test_changed_grasps_are_the_recipe_s_but_for_the_change(data):
    grasps = data.grasps("made", each=1)
    assert [g.grasp_id for g in grasps] == [
        f"virtual-01/virtual-01_cube_{edge}_01" for edge in (20, 25)
    ]
    assert len(data.grasps("made", sessions=2)) == 8
    same = data.changed("made", "size", grasps, {})
    assert same.value.tolist() == [20, 25]
    assert same.group.tolist() == [g.grasp_id for g in grasps]
    centred = data.changed("made", "size", grasps, {}, pose=0.0)
    moved = data.changed("made", "size", grasps, {"grasp": {"offset_x_mm": 0.0}})
    assert np.array_equal(centred.feature, moved.feature)
    assert not np.array_equal(centred.feature, same.feature)
    kept = len(list(data.paths.responses.rglob("*.npz")))
    again = data.changed("made", "size", grasps, {})
    assert np.array_equal(again.feature, same.feature)
    assert len(list(data.paths.responses.rglob("*.npz"))) == kept == 4


def test_ablations_are_made_where_all_their_data_sets_are_simulated():
    assert possible(["orientation", "ycb"]) == ["grouped_vs_random"]
    setups = [name for name, _ in mirror.DATASETS.values()]
    assert possible(["orientation", "ycb", *setups]) == ["mirror", "grouped_vs_random"]
    assert possible([]) == []
    every = {dataset for name in ABLATIONS for dataset in ablation(name).datasets}
    assert possible(sorted(every)) == list(ABLATIONS)
    assert [ablation(name).name for name in ABLATIONS] == list(ABLATIONS)
    with pytest.raises(ValueError, match="there is no ablation 'copies': choose among variance"):
        ablation("copies")


def test_an_ablation_that_cannot_be_made_says_why(tmp_path):
    paths = Paths(tmp_path)
    paths.dataset("ycb").parent.mkdir(parents=True)
    paths.dataset("ycb").write_text("name: ycb\n")
    run_ablation(paths, "repeatability", paths.ablation("repeatability"), seed=0)
    _, (table,) = read_tables(paths.ablation("repeatability"))
    assert "ycb has no recipe" in table.rows[0]["reason"]
    assert reasons_of([table], "ablations") == []


def trial(claim: str, after: float, model: str = "linear", expected: str = "better") -> Trial:
    before = (5.0, 5.2, 4.8, 5.1, 4.9)
    folds = tuple(after + x for x in (0.0, 0.1, -0.1, 0.05, -0.05))
    hypothesis = Hypothesis(("size", "noise"), claim, "other training", expected)
    return Trial(hypothesis, model, "rmse", "mm", Folds(before, 1.5), Folds(folds, 2.5))


def test_a_trial_says_what_was_found():
    row = trial("it helps", 1.0).row()
    assert (row["before"], row["after"]) == pytest.approx((5, 1))
    assert row["gain"] == pytest.approx(4)
    assert row["gain_low"] > 0
    assert (row["seconds"], row["model"], row["metric"]) == (4.0, "ridge", "RMSE (mm)")
    assert row["p"] < 0.001


def judged(*trials: Trial) -> Table:
    (table,) = with_verdicts([trial_table("noise", "Noise", "", trials)])
    return table


def test_a_trial_has_a_verdict():
    table = judged(
        trial("it helps", 1.0),
        trial("it helps", 9.0),
        trial("it hurts", 9.0, expected="worse"),
        trial("nothing", 5.0),
    )
    assert table.column("verdict") == ["supported", "refuted", "supported", "not supported"]
    assert "for the 4 tests on this page (Holm)" in table.note


def test_folds_that_all_differ_alike_are_not_testable_and_do_not_count():
    before = (5.0, 5.2, 4.8, 5.1, 4.9)
    hypothesis = Hypothesis(("size",), "nothing", "nothing", "better")
    same = Trial(hypothesis, "linear", "rmse", "mm", Folds(before, 1.0), Folds(before, 1.0))
    table = judged(same, trial("it helps", 1.0))
    cells = ("verdict", "gain", "gain_low", "gain_high", "p", "p_holm")
    assert [table.rows[0][key] for key in cells] == ["not testable", 0.0, None, None, None, None]
    assert "for the 1 tests on this page" in table.note
    assert table.rows[1]["p_holm"] == table.rows[1]["p"]


def test_the_more_tests_a_page_has_the_more_each_needs():
    """A gain with p of about 0.02: supported as the only test, not as one of twenty, in whichever
    table of the page the other tests are."""
    weak = trial("it helps", 4.82)
    assert 0.01 < weak.row()["p"] < 0.05
    assert judged(weak).column("verdict") == ["supported"]
    alone = trial_table("first", "First", "", [weak])
    others = trial_table("others", "Others", "", [trial("nothing", 5.0)] * 19)
    plain = table_of("plain", "Plain", [{"share": 0.5}], share="Share")
    first, second, third = with_verdicts([alone, plain, others])
    assert first.column("verdict") == ["not supported"]
    assert first.rows[0]["p_holm"] == pytest.approx(20 * weak.row()["p"])
    assert second == plain and len(third.rows) == 19
    assert "for the 20 tests on this page" in first.note


def test_reasons_are_supported_changes_towards_the_paper():
    table = trial_table(
        "noise", "Noise", "", [trial("it helps", 1.0), trial("it helps", 5.0, "knn"),
                               trial("nothing", 5.0)]
    )  # fmt: skip
    helps, nothing = reasons_of(with_verdicts([table]), "ablations")
    assert helps.of == ("size", "noise")
    assert helps.link == "ablations.html#noise"
    assert [(one.model, one.supported) for one in helps.tests] == [("ridge", True), ("k-NN", False)]
    assert helps.explains(low=False)  # ours is too high, and the change lowers it
    assert not helps.explains(low=True)
    assert not nothing.explains(low=False)


FOUND = {
    "mirror": (
        "Withheld angles: 10° default, 20° transducers at unequal radii, 30° bar 3 mm off its axis;"
        " angle from the mirror plane 1°"
    ),
    "materials": "Hard materials are told in 50 to 70 % with 100 % of the scatter of grasps",
    "variance": "Between grasps of one object in one session lies 20 % (ball) to 60 % (cube)",
    "noise": "At 80 dB(A) ridge trained at all errs by 2 mm, ridge trained at 45 errs by 9 mm.",
}


def drawn(name, table):
    """Points of the figures of an ablation's table, which are drawn as well."""
    points = []
    for illustration, figure in zip(
        placed_figures(ablation(name).figures, [table])[table.name],
        ablation(name).figures,
        strict=True,
    ):
        assert illustration.caption.alt.startswith(FOUND[name])
        assert fits(draw(illustration))
        made = figure.picture(table).points
        points.append([(p.panel, p.series, p.x, p.score.mean) for p in made])
    return points


def angle_rows():
    """Two of the paper's angles and one between; the first is withheld."""
    for n, (angle, grid) in enumerate(((0.0, "paper"), (4.5, "between"), (9.0, "paper"))):
        row = {"angle": angle, "plane": 83.4 - angle, "grid": grid, "withheld": n == 0}
        for m, key in enumerate(SETUPS):
            row |= {f"{DIRECTION}{key}": 10.0 * (m + 1) + n, f"{FROM_PLANE}{key}": 1.0 + n}
        yield row


def test_the_mirror_s_figure_has_a_line_a_setup_for_both_targets():
    rows = list(angle_rows())
    table = table_of("mirror_angles", "t", rows, **dict.fromkeys(rows[0], "x"))
    (points,) = drawn("mirror", table)
    direction = [p[1:] for p in points if p[0] == "direction"]
    assert direction[:3] == [("default", 0, 10), ("default", 4.5, 11), ("default", 9, 12)]
    assert [p[2] for p in direction[3:]] == [20, 21, 22, 30, 31, 32]
    assert [p[3] for p in points if p[0] != "direction"] == [1, 2, 3] * 3


def test_errors_of_both_targets_stand_at_the_angle_that_they_are_of(data):
    """Predictions of the angle from the plane are read back at its own values."""
    labels = [{"angle_deg": a, "angle_from_plane_deg": p, "grid": "paper"} for a, p in
              ((0.0, 80.0), (90.0, 10.0))]  # fmt: skip
    path = data.paths.dataset(mirror.DATASETS["default"][0])
    path.parent.mkdir(parents=True)
    made = [{"name": f"bar_{n}", "shape": "bar", "targets": one} for n, one in enumerate(labels)]
    targets = {key: {"kind": "regression"} for key in ("angle_deg", "angle_from_plane_deg")}
    declared = {"name": path.parent.name, "targets": targets | {"grid": {"kind": "classification"}}}
    recipe = {"grasps_per_object": 1, "objects": made}
    path.write_text(yaml.safe_dump(declared | {"recipe": recipe}))

    def validated(truth, errors, withheld):
        known, held = (np.array(truth) != withheld, np.array(truth) == withheld)
        predicted = np.array(truth) + errors

        def some(rows):
            count = int(rows.sum())
            row, fold = np.arange(count), np.zeros(count, int)
            return crossval.Predictions(row, fold, np.array(truth)[rows], predicted[rows], None)

        tested = crossval.Tested(None, some(held))
        return crossval.CrossValidation(None, some(known), None, {mirror.WITHHELD: tested})

    one = mirror.Errors(validated([0.0, 90.0], [178.0, 7.0], 0.0),
                        validated([80.0, 10.0], [3.0, 4.0], 80.0))  # fmt: skip
    table = mirror.angle_table(data, dict.fromkeys(SETUPS, one))
    assert table.column("withheld") == [True, False]
    # 178° and 0° are 2° apart after half a turn
    assert table.numbers("direction_unequal").tolist() == [2, 7]
    assert table.numbers("from_plane_unequal").tolist() == [3, 4]


def test_the_materials_figure_has_distances_and_accuracies_of_each_data_set():
    rows = [
        {"dataset": dataset, "share": share, "within": 2 * share, "between": 0.1, "linear": right}
        for dataset, right in (("ball", 0.5), ("plate", 0.7))
        for share in (1.0, 0.01)
    ]
    table = table_of("materials_scatter", "t", rows, **{key: key for key in rows[0]})
    distances, accuracies = drawn("materials", table)
    assert ("", "ball, two grasps", 1, 2) in distances
    assert ("", "plate, materials", 0.01, 0.1) in distances
    assert [p[3] for p in accuracies] == [0.5, 0.5, 0.7, 0.7]


def test_the_noise_figure_has_a_line_for_each_model_and_training_set():
    columns = {"model": "m", "trained": "t", "rmse_45": "a", "rmse_80": "b", "seconds": "s"}
    rows = [
        {"model": "ridge", "trained": trained, "rmse_45": 1.0, "rmse_80": worst, "seconds": 1.0}
        for trained, worst in (("at 45", 9.0), ("at all", 2.0))
    ]
    (points,) = drawn("noise", table_of("noise_levels", "t", rows, **columns))
    assert points == [
        ("", "ridge, at 45", 45, 1), ("", "ridge, at 45", 80, 9),
        ("", "ridge, at all", 45, 1), ("", "ridge, at all", 80, 2),
    ]  # fmt: skip


def test_the_variance_figure_has_what_is_known():
    parts = [
        {"object": 70, "gripper": None, "session": 5, "object_in_session": 5, "grasp": 20},
        {"object": 30, "gripper": 10, "session": None, "object_in_session": 0, "grasp": 60},
        {"object": 5, "gripper": None, "session": 5, "object_in_session": 0, "grasp": 90},
    ]
    recording = {"ball": 0, "cube": 0, "once": None}  # whose grasps hold what recordings add
    rows = [
        {"dataset": dataset, "band": band, **part, "recording": known, "scatter": 0.1}
        for (dataset, known), part in zip(recording.items(), parts, strict=True)
        for band in ("whole", "low")
    ]
    (points,) = drawn("variance", table_of("variance", "t", rows, **{k: k for k in rows[0]}))
    ball = [p[3] for p in points if p[0] == "whole" and p[2] == "ball"]
    assert ball == [70, 5, 5, 20, 0]  # what is not known has no point
    only = [row for row in rows if row["dataset"] == "once"]
    told = variance.finding(table_of("variance", "t", only, **{key: key for key in rows[0]}))
    assert told.startswith("Between grasps of one object in one session, of one recording each,")
