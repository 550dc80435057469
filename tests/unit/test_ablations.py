"""Ablations: the mirror plane, changed grasps, verdicts, and how the report uses them."""

import math

import numpy as np
import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.gripper.scene import Nuisance
from ajgdata.paths import Paths
from ajgdata.pipeline.ablations import ABLATIONS, possible, run_ablation
from ajgdata.pipeline.ablations.bench import NUISANCES, Bench, nuisances
from ajgdata.pipeline.ablations.mirror import LOPSIDED, mirror_plane
from ajgdata.pipeline.ablations.trials import Folds, Hypothesis, Trial, trial_table
from ajgdata.report.reasons import reasons_of
from ajgdata.store.tables import read_tables

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
def bench(tmp_path) -> Bench:
    paths = Paths(tmp_path)
    paths.dataset("made").parent.mkdir(parents=True)
    paths.dataset("made").write_text(yaml.safe_dump(DECLARATION))
    return Bench(paths)


def reflected(place: complex, axis_deg: float) -> complex:
    return np.exp(2j * np.deg2rad(axis_deg)) * place.conjugate()


@given(st.floats(0, 180), st.floats(10, 35), st.floats(10, 35), st.floats(20, 160))
@settings(max_examples=25, derandomize=True, deadline=None)
def test_the_mirror_plane_of_mirrored_transducers_is_found(axis, near, far, opening):
    """Either both lie on the plane, or one is the other's image."""
    on = np.exp(1j * np.deg2rad(axis))
    both = [(near * on, -far * on)]
    half = np.exp(1j * np.deg2rad(opening / 2))
    both.append((near * on * half, near * on / half))
    for speaker, microphone in both:
        assume(abs(speaker - microphone) > 5)  # they may not overlap
        gripper = Gripper(
            speaker_mm=(speaker.real, speaker.imag),
            microphone_mm=(microphone.real, microphone.imag),
        )
        found, misfit = mirror_plane(gripper)
        # the misfit is the root of a difference of squares of 35 mm: √eps of that
        assert misfit < 1e-5
        images = {reflected(speaker, found), reflected(microphone, found)}
        for place in (speaker, microphone):
            assert min(abs(place - image) for image in images) < 1e-5


def test_the_best_plane_is_the_best_of_all_angles():
    for name in ("default", "asymmetric", "close-transducers"):
        gripper = GRIPPERS[name]
        s, m = complex(*gripper.speaker_mm), complex(*gripper.microphone_mm)
        axis, misfit = mirror_plane(gripper)

        def missed(angle: float, s: complex = s, m: complex = m) -> float:
            first, second = reflected(s, angle), reflected(m, angle)
            kept = abs(first - s) ** 2 + abs(second - m) ** 2
            return math.sqrt(min(kept, abs(first - m) ** 2 + abs(second - s) ** 2) / 2)

        assert missed(axis) == pytest.approx(misfit, abs=1e-6)
        assert misfit <= min(missed(angle) for angle in np.linspace(0, 180, 181)) + 1e-9
    assert mirror_plane(GRIPPERS["symmetric"]) == pytest.approx((0, 0), abs=1e-6)
    misfits = [mirror_plane(g)[1] for g in (GRIPPERS["default"], *LOPSIDED)]
    assert misfits == sorted(misfits)
    assert misfits[-1] > 10


def test_nuisances_scale_what_differs_between_grasps_and_nothing_else():
    base = Nuisance()
    assert set(NUISANCES) == {n for n in Nuisance.model_fields if "correlation" not in n}
    assert Nuisance(**nuisances(1)) == base
    assert set(nuisances(0).values()) == {0}
    assert nuisances(2, ("force",)) == {
        **dict.fromkeys(NUISANCES, 0),
        "force": 2 * base.force,
    }


def test_changed_grasps_are_the_recipe_s_but_for_the_change(bench):
    grasps = bench.grasps("made", each=1)
    assert [g.grasp_id for g in grasps] == [
        f"virtual-01/virtual-01_cube_{edge}_01" for edge in (20, 25)
    ]
    assert len(bench.grasps("made", sessions=2)) == 8
    same = bench.changed("made", "size", grasps, {})
    assert same.value.tolist() == [20, 25]
    assert same.group.tolist() == [g.grasp_id for g in grasps]
    centred = bench.changed("made", "size", grasps, {}, pose=0.0)
    moved = bench.changed("made", "size", grasps, {"grasp": {"offset_x_mm": 0.0}})
    assert np.array_equal(centred.feature, moved.feature)
    assert not np.array_equal(centred.feature, same.feature)
    kept = len(list(bench.paths.responses.rglob("*.response")))
    again = bench.changed("made", "size", grasps, {})
    assert np.array_equal(again.feature, same.feature)
    assert len(list(bench.paths.responses.rglob("*.response"))) == kept == 4


def test_ablations_are_made_where_all_their_data_sets_are_simulated():
    assert possible(["orientation", "ycb"]) == ["mirror", "copies"]
    assert possible([]) == []
    every = {name for one in ABLATIONS.values() for name in one.datasets}
    assert possible(sorted(every)) == list(ABLATIONS)


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
    assert (row["verdict"], row["seconds"], row["model"]) == ("supported", 4.0, "ridge")
    assert row["metric"] == "RMSE (mm)"
    assert trial("it helps", 9.0).row()["verdict"] == "refuted"
    assert trial("it hurts", 9.0, expected="worse").row()["verdict"] == "supported"
    assert trial("nothing", 5.0).row()["verdict"] == "not supported"


def test_reasons_are_supported_changes_towards_the_paper():
    table = trial_table(
        "noise", "Noise", "", [trial("it helps", 1.0), trial("it helps", 5.0, "knn"),
                               trial("nothing", 5.0)]
    )  # fmt: skip
    helps, nothing = reasons_of([table], "ablations")
    assert helps.of == ("size", "noise")
    assert helps.link == "ablations.html#noise"
    assert [(one.model, one.supported) for one in helps.tests] == [("ridge", True), ("k-NN", False)]
    assert helps.explains(low=False)  # ours is too high, and the change lowers it
    assert not helps.explains(low=True)
    assert not nothing.explains(low=False)
