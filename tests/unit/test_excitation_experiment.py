"""Simulated recordings made again with other sounds, and what models make of them."""

import numpy as np
import pytest
from drawn_figures import fits, texts
from experiment_samples import measured, small_inputs, task_results

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.evaluate.crossval import cross_validate
from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.base import Inputs, Outcome, score_table
from ajgdata.experiments.excitation import declared, features_of, measure, recovered_db
from ajgdata.experiments.excitation.shown import BAND_HZ, finding
from ajgdata.features.spectrum import spectrum
from ajgdata.features.transfer_function import REGULARISATION
from ajgdata.pipeline.acquire import acquire_virtual
from ajgdata.pipeline.rendering import renderer
from ajgdata.report.canvas import draw
from ajgdata.store.audio import read_audio
from ajgdata.store.features import Column, Shard, text_column
from ajgdata.store.sessions import read_recordings
from ajgdata.types import (
    DEFAULT_EXCITATION,
    AudioSettings,
    FeatureSettings,
    LinearSweep,
    MaximumLengthSequence,
)
from ajgdata.types.table import table_of

AUDIO, RATE = AudioSettings(), 44_100
RECIPE = {
    "grasps_per_object": 3,
    "samples_per_grasp": 2,
    "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
    "vary": {"angle_deg": [-10, 10]},
    "objects": [
        {"name": f"cube_{edge}", "shape": {"kind": "cube", "edge_mm": edge},
         "targets": {"edge_mm": edge}}
        for edge in (12, 28)
    ],
}  # fmt: skip


@pytest.fixture
def recorded(project) -> Inputs:
    """A task on a data set that the virtual gripper recorded."""
    project.declare(audio={}, features={}, recipe=RECIPE)
    acquire_virtual(project.paths, "d", "virtual-01")
    folder = project.paths.session("d", "virtual-01")
    rows = read_recordings(folder)[0]
    samples = [read_audio(folder / row.file, AUDIO).samples for row in rows]
    columns = {
        "recording": text_column([f"virtual-01/{row.recording_id}" for row in rows]),
        "grasp_id": text_column([f"virtual-01/{row.grasp_id}" for row in rows]),
        "edge_mm": Column(np.array([float(row.labels["edge_mm"]) for row in rows])),
    }
    feature = np.array([spectrum(one, RATE, FeatureSettings()) for one in samples])
    attrs = {"data_set": "d", "source": "simulated", "git_commit": "", "settings": "{}"}
    shard = Shard(feature, np.fft.rfftfreq(2048, 1 / RATE), columns, attrs)
    return Inputs(
        "d", "t", "edge_mm", "regression", "mm", "grasp_id", 3, 0, shard, audio=AUDIO,
        render=renderer(project.paths, "d"),
    )  # fmt: skip


def test_the_sound_that_was_played_gives_the_recordings_and_another_its_own(project, recorded):
    folder = project.paths.session("d", "virtual-01")
    names = recorded.store.columns["recording"].values.tolist()
    sounds = [excitation_samples(one, RATE) for one in (DEFAULT_EXCITATION, LinearSweep())]
    for row, (same, other) in zip(
        read_recordings(folder)[0], recorded.render(names, sounds), strict=True
    ):
        assert np.array_equal(same, read_audio(folder / row.file, AUDIO).samples)
        assert other.shape == same.shape and not np.array_equal(other, same)
    quiet = [one for (one,) in recorded.render(names[:2], sounds[:1], quiet=True)]
    assert np.array_equal(*quiet)  # two samples of a grasp differ in their noise alone
    ((first, _), (second, _)) = recorded.render(names[:2], sounds)
    assert not np.array_equal(first, second)


def test_what_was_not_simulated_is_not_rendered(project, recorded):
    with pytest.raises(
        ValueError, match=r"needs a virtual data set: recording 'other/a_1' was not"
    ):
        list(recorded.render(["other/a_1"], [np.ones(10)]))
    project.declare()
    with pytest.raises(ValueError, match="needs a virtual data set: d was not simulated"):
        list(renderer(project.paths, "d")(["s1/a"], [np.ones(10)]))
    with pytest.raises(ValueError, match="needs a virtual data set"):
        measured("excitation", small_inputs("classification"))


def test_the_papers_sweep_makes_the_features_of_the_store(recorded):
    data = recorded.data()
    sound = excitation_samples(DEFAULT_EXCITATION, RATE)
    short = excitation_samples(MaximumLengthSequence(length_s=0.1), RATE)
    (feature, seconds), (other, _) = features_of(recorded, data, [sound, short])
    assert np.array_equal(feature, data.feature)
    assert other.shape == feature.shape and seconds > 0
    assert np.abs(other - feature).sum(axis=1).min() > 0.1  # of 2 at most


def test_a_response_is_recovered_as_well_as_the_noise_allows(recorded):
    """White noise of 38.6 dB SPL, full scale at 129: σ. Each of K values of H, of M samples of h,
    has the error M σ²/(x² (n - M)), least squares on n samples of a white sequence of amplitude x;
    the sum over K of them scatters by 1/sqrt(K), 4 %. Regularisation takes 1e-4 of H away."""
    data, taps = recorded.data(), recorded.features.window
    sigma = 10 ** ((38.6 - 129) / 20) / np.sqrt(2)
    frequency = np.fft.rfftfreq(taps, 1 / RATE)
    inside = (frequency >= BAND_HZ[0]) & (frequency <= BAND_HZ[1])
    click = np.zeros(taps)
    click[0] = 0.9
    ((heard,),) = recorded.render(data.name[:1].tolist(), [click], quiet=True)
    true = np.fft.rfft(heard / 0.9)[inside]
    for length_s in (0.25, 0.5):
        sound = excitation_samples(MaximumLengthSequence(length_s=length_s), RATE)
        variance = taps * sigma**2 / (0.9**2 * (len(sound) - taps))
        share = inside.sum() * variance / np.sum(np.abs(true) ** 2) + REGULARISATION**2
        expected_db = 10 * np.log10(share)
        ((found_db,),) = recovered_db(recorded, data, 1, [sound])
        assert found_db == pytest.approx(expected_db, abs=0.7)  # 16 %: four deviations


SETTINGS = {"lengths_s": [0.1, 1.0], "kinds": ["log_sweep", "mls"], "models": ["linear"]}


def test_every_excitation_is_measured_on_the_same_folds_and_twice_the_same(recorded):
    outcome = measured("excitation", recorded, responses=2, **SETTINGS)
    again = measured("excitation", recorded, responses=2, **SETTINGS)
    assert again.tables == outcome.tables
    scores, points = outcome.tables
    assert points.column("part") == [
        "excitation:log_sweep 1 s", "excitation:log_sweep 0.1 s", "excitation:mls 0.1 s",
        "excitation:mls 1 s",
    ]  # fmt: skip
    assert set(points.column("level")) == {DEFAULT_EXCITATION.level_dbfs}
    data = recorded.data()
    own = cross_validate(data.feature, data.value, data.group, model="linear", **recorded.split)
    found = scores.where(part="excitation:log_sweep 1 s", metric="rmse", statistic="mean")
    assert found.column("value") == [own.scores.mean["rmse"]]
    (cost,) = outcome.cost
    assert (cost.where(metric="feature_s_per_recording").numbers("value") > 0).all()


def test_the_papers_sweep_is_always_tried_and_all_have_its_level():
    settings = EXPERIMENTS["excitation"].settings
    tried = declared(settings(lengths_s=[0.1, 0.5], kinds=["mls"]))
    assert [(one.kind, one.length_s) for one in tried] == [
        ("log_sweep", 1.0), ("mls", 0.1), ("mls", 0.5)
    ]  # fmt: skip
    assert {one.amplitude for one in tried} == {0.9}
    assert len(declared(settings())) == 25
    check = EXPERIMENTS["excitation"].check
    with pytest.raises(ValueError, match=r"excitation: chirp_s 0\.02: not one chirp fits"):
        check(settings(lengths_s=[0.01, 1.0]), "regression", FeatureSettings())
    with pytest.raises(ValueError, match=r"no features\.align"):
        check(settings(), "regression", FeatureSettings(align=True))


def test_a_slow_model_meets_other_kinds_at_few_lengths(recorded):
    settings = {"lengths_s": [0.1, 0.5], "kinds": ["log_sweep", "mls"], "models": ["knn", "ridge"]}
    few = {"slow": ["knn"], "slow_lengths_s": [0.5], "responses": 1}
    outcome = measured("excitation", recorded, **settings, **few)
    scores = outcome.tables[0].where(metric="rmse", statistic="mean")
    missing = "excitation:mls 0.1 s"
    assert scores.where(part=missing).column("model") == ["ridge"]
    assert len(scores.rows) == 2 * 5 - 1
    results = task_results("excitation", {"": outcome}, "regression", settings | few)
    lines = EXPERIMENTS["excitation"].tables(results)[0].rows
    assert [row[4] == "—" for row in lines] == [row[:2] == ("MLS", "0.1") for row in lines]
    assert "with 1 kind of 0.1 s," in finding(results, 0)
    assert "with 2 kinds of 0.1 s," in finding(results, 1)
    assert all(fits(draw(one)) for one in EXPERIMENTS["excitation"].figures(results))


def shown(kinds=("log_sweep", "linear_sweep", "mls"), wrong=lambda kind, length: 0.2):
    """Results by hand: the share that is wrong by kind and length."""
    lengths = (0.1, 1.0)
    tried = [("log_sweep", 1.0), *((k, n) for k in kinds for n in lengths)]
    tried = list(dict.fromkeys(tried))
    parts = {(kind, n): f"excitation:{kind} {n:g} s" for kind, n in tried}
    values = {"mean": lambda w: 1 - w, "sd": lambda w: 0.01, "chance": lambda w: 0.25}
    values |= {f"fold {n}": lambda w, n=n: 1 - w + 0.01 * (n - 1) for n in range(3)}
    rows = [
        (model, parts[one], "accuracy", statistic, value(wrong(*one)))
        for one in tried for model in ("cnn", "linear_plain") for statistic, value in values.items()
    ]  # fmt: skip
    points = [
        {"part": parts[k, n], "kind": k, "length_s": n, "level": -0.9, "crest_db": 3.0}
        | {"recovered_db": -60 - n, "worst_db": -50.0}
        for k, n in tried
    ]
    keys = dict.fromkeys(points[0], "x")
    cost = [("cnn", f"cost of {p}", "feature_s_per_recording", "measured", 1e-3)
            for p in parts.values()]  # fmt: skip
    outcome = Outcome(
        (score_table(rows, ""), table_of("excitations", "", points, **keys)),
        (score_table(cost, ""),),
    )
    settings = {"lengths_s": lengths, "kinds": kinds}
    return task_results("excitation", {"": outcome}, "classification", settings)


def test_figures_say_what_was_found_and_fit():
    results = shown(wrong=lambda kind, n: 0.205 if kind == "mls" else 0.2 + 0.3 * (n < 1))
    text = "Exploratory: CNN share that is wrong 20.5 to 50 % with 3 kinds of 0.1 s, 20 % with the"
    assert finding(results, 0) == f"{text} paper's sweep"
    error, response = EXPERIMENTS["excitation"].figures(results)
    for one in (error, response):
        figure = draw(one)
        assert fits(figure)
        assert {"log sweep", "linear sweep", "MLS", "paper", "simulated"} <= set(texts(figure))
    assert "Exploratory: CNN share" in " ".join(texts(draw(error)))
    assert "20.0 ± 1.0 % with the paper's log sweep of 1 s" in error.caption.text
    assert "by kinds 20.5 to 50 % with 3 of 0.1 s, 20 to 20.5 % with 3 of 1 s" in error.caption.text
    assert "chance: 75 %" in error.caption.text
    assert "Error of the recovered response: -61 to -60.1 dB for 6" in response.caption.alt
    (table,) = EXPERIMENTS["excitation"].tables(results)
    assert [row[:2] for row in table.rows[:3]] == [
        ("log sweep", "0.1"), ("log sweep", "1"), ("linear sweep", "0.1")
    ]  # fmt: skip
    assert all(len(row) == len(table.heads) for row in table.rows)


def test_the_best_of_several_sounds_is_not_reported():
    """One kind that happens to do well moves one end of the range, nothing else."""
    plain, lucky = shown(), shown(wrong=lambda kind, n: 0.05 if (kind, n) == ("mls", 0.1) else 0.2)
    (first,), (second,) = (EXPERIMENTS["excitation"].highlights(one) for one in (plain, lucky))
    ours, paper = second.marks
    assert (ours.label, ours.low, ours.high) == ("0.1 s", pytest.approx(5), pytest.approx(20))
    assert ours.value == pytest.approx(15) and paper.value == pytest.approx(20)  # their mean
    assert first.marks[0].low == pytest.approx(20) and "exploratory" in second.said
    (table,) = EXPERIMENTS["excitation"].tables(lucky)
    assert len(table.rows) == 6


def test_what_it_follows_from_begins_at_its_measurement():
    assert EXPERIMENTS["excitation"].measure is measure and EXPERIMENTS["excitation"].renders
