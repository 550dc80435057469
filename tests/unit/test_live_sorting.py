"""New grasps of a recipe's objects, and runs of sorting them."""

import numpy as np
import pytest
from experiment_samples import measured, small_inputs, task_results

from ajgdata.acquire.recipe import new_grasp, plan_session
from ajgdata.evaluate.sorting import orders
from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.base import Inputs
from ajgdata.features.spectrum import spectrum
from ajgdata.gripper import Scene
from ajgdata.pipeline.rendering import new_grasps_of
from ajgdata.report.paper import PaperFigure
from ajgdata.types import FeatureSettings, NotPossibleError, Recipe

RATE = 44_100
OBJECTS = ("cube_12", "cube_28")
RECIPE = {
    "grasps_per_object": 4,
    "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
    "vary": {"angle_deg": [-10, 10], "offset_x_mm": [-2, 2]},
    "objects": [
        {"name": name, "shape": {"kind": "cube", "edge_mm": int(name[-2:])}} for name in OBJECTS
    ],
}  # fmt: skip
DECLARED = {"audio": {}, "features": {}, "targets": {"object": {"kind": "classification"}}}
PAPER = PaperFigure(
    id="sorting", metric="sorts in a row", value=3, unit="sorts", text="3 sorts", where="live"
)


def test_new_grasps_are_new_and_looks_share_a_pose():
    recipe = Recipe.model_validate(RECIPE)
    first, second, other = (
        new_grasp(recipe, "d", "cube_12", number, look, "code")
        for number, look in ((1, 1), (1, 2), (2, 1))
    )
    poses = [{k: g.setup["grasp"][k] for k in recipe.vary} for g in (first, second, other)]
    assert poses[0] == poses[1] != poses[2]
    recorded = plan_session(recipe, "d", "virtual-01", "code")
    seeds = [g.setup["grasp"]["seed"] for g in (first, second, other, *recorded)]
    assert len(set(seeds)) == len(seeds)
    for low, high in recipe.vary.values():
        assert all(low <= pose["angle_deg"] <= 10 for pose in poses) and high <= 10
    assert Scene.model_validate(first.setup).object.edge_mm == 12
    assert new_grasp(recipe, "d", "cube_12", 1, 1, "code") == first
    with pytest.raises(NotPossibleError, match=r"has no object 'ball': it has cube_12, cube_28"):
        new_grasp(recipe, "d", "ball", 1, 1, "code")
    variants = Recipe.model_validate(RECIPE | {"variants": {"coffee": {}}})
    with pytest.raises(NotPossibleError, match="without variants"):
        new_grasp(variants, "d", "cube_12", 1, 1, "code")


def test_new_grasps_of_one_pose_differ_less_than_objects(project):
    project.declare(**DECLARED, recipe=RECIPE)
    sense = new_grasps_of(project.paths, "d")
    wanted = [("cube_12", 1, 1), ("cube_12", 1, 2), ("cube_28", 1, 1)]
    features = [spectrum(sound, RATE, FeatureSettings()) for sound in sense(wanted)]
    again, other = (np.linalg.norm(feature - features[0]) for feature in features[1:])
    assert 0 < again < other


def known(inputs: Inputs, doubtful: set[int]):
    """New grasps that sound as recordings do; a ball and a box, in placements `doubtful`, as one
    halfway between them at the first look."""
    value = inputs.store.columns["object"].values
    sound = {o: np.log(inputs.store.feature[value == o]).mean(axis=0) for o in np.unique(value)}
    middle = (sound["ball"] + sound["box"]) / 2

    def sensed(wanted):
        for name, number, look in wanted:
            halfway = number in doubtful and look == 1 and name != "rod"
            log = middle if halfway else sound[name]
            yield np.fft.irfft(np.exp(log), 118)

    return sensed


def test_what_is_doubtful_at_first_is_sorted_at_the_second_look(monkeypatch):
    """The feature is the spectrum itself: what is heard is known, and so is each run's length."""
    import ajgdata.features.maker as made

    monkeypatch.setattr(
        made, "feature_maker", lambda *_: lambda heard: np.abs(np.fft.rfft(heard)).astype("f4")
    )
    inputs = small_inputs()
    small = small_inputs(new_grasps=known(inputs, {2}))
    settings = {"placements": 4, "looks": 2, "runs": 5, "threshold": 0.9}
    outcome = measured("live_sorting", small, "linear_plain", **settings)
    _, conditions, runs = outcome.tables
    one, two = (conditions.where(part="plain", looks=n).rows[0] for n in (1, 2))
    assert (one["accepted"], two["accepted"]) == (10 / 12, 1.0)
    assert (one["wrong"], two["wrong"]) == (0, 0)
    assert two["mean_looks"] == pytest.approx(14 / 12)
    # The second placement of ball and of box stops a run with one look: rows 1 and 5 of 12.
    expected = [next(n for n, row in enumerate(o) if row in (1, 5)) for o in orders(12, 5, 0)]
    assert runs.where(part="plain", looks=1).column("sorts") == expected
    assert runs.where(part="plain", looks=2).column("sorts") == [12] * 5
    results = task_results(
        "live_sorting", {"linear": outcome}, settings=settings, papers={"live_sorting": PAPER}
    )
    one = EXPERIMENTS["live_sorting"]
    lengths, _ = one.figures(results)
    mean = f"plain, logistic regression, looks at most 1: {np.mean(expected):.1f} ± "
    assert mean in lengths.caption.alt
    (row,) = one.paper_comparison(results, lambda *_: None)
    assert row.label == "new grasps" and row.marks[0].value == np.median(expected)
    assert "0 % in a wrong bin" in row.result
