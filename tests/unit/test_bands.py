"""Twins of a task from a part of the band: the bins that are heard, their scores, what is shown."""

import dataclasses

import numpy as np
import pytest
from drawn_figures import fits
from experiment_samples import small_inputs, small_store
from result_samples import paper_figure, size_result, sizes

from ajgdata.experiments.cross_validation import EXPERIMENT, Settings, measure
from ajgdata.experiments.cross_validation.bands import confined
from ajgdata.features.bands import within
from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.report.canvas import styled
from ajgdata.report.format import Score
from ajgdata.types import FeatureSettings, NotPossibleError, Task

RATE = 44_100
BANDS = ((60.0, 6_000.0), (60.0, 1_200.0))


@pytest.mark.parametrize("normalisation", ["l1", "l2", "max", "none"])
@pytest.mark.parametrize("band", BANDS)
def test_bins_of_a_stored_feature_are_the_feature_of_that_band(normalisation, band):
    """Each is rounded to float32 once, hence twice 2**-24 apart at the most, and a norm's ulp."""
    sound = np.random.default_rng(0).standard_normal((2, 8192)).cumsum(axis=1)
    whole = FeatureSettings(normalisation=normalisation)
    stored = np.array([spectrum(one, RATE, whole) for one in sound])
    part = whole.model_copy(update={"band_hz": band})
    found, hz = within(stored, frequencies_hz(RATE, whole), band, normalisation)
    np.testing.assert_allclose(found, [spectrum(one, RATE, part) for one in sound], rtol=4 * 2**-24)
    np.testing.assert_array_equal(hz, frequencies_hz(RATE, part))
    assert found.dtype == np.float32


def test_a_band_without_bins_is_refused():
    with pytest.raises(ValueError, match=r"no bin of the feature lies within 0\.1 to 0\.9 Hz"):
        within(np.ones((1, 8)), np.arange(8.0), (0.1, 0.9), "l1")
    with pytest.raises(NotPossibleError, match="bands: no bin"):
        confined(small_inputs(), (1_000, 2_000))


@pytest.mark.parametrize(
    ("bands", "problem"),
    [([[60, 60]], "must be 0 <= low < high"), ([[60, 6000], [60, 6000]], "lists one twice")],
)
def test_bands_that_cannot_be_are_refused_where_they_are_declared(bands, problem):
    with pytest.raises(ValueError, match=problem):
        Task(target="edge_mm", bands=bands)
    assert Task(target="edge_mm", bands=[[60, 6000]]).asked["cross_validation"]["bands"]


def scores(outcome, part):
    return outcome.tables[0].where(part=part, statistic="mean")


def once(**changes) -> Settings:
    """Settings without the further splits, which take no part in twins."""
    return Settings(repeats=1, compare_sessions="none", **changes)


def test_a_twin_is_the_task_with_a_feature_of_that_band_alone():
    """Bins 0 to 19 tell the object, those from 20 on hold noise."""
    band, store = (0.0, 19.0), small_store()
    settings = once(bands=(band, (20.0, 59.0)), test_on=("b",))
    others = {"b": small_store(1)}
    inputs = small_inputs(others=others)
    found = measure(inputs, settings, "linear_plain")
    feature, hz = within(store.feature, store.frequency_hz, band, "l1")
    alone = dataclasses.replace(store, feature=feature, frequency_hz=hz)
    feature, _ = within(others["b"].feature, hz_of(others), band, "l1")
    there = dataclasses.replace(others["b"], feature=feature, frequency_hz=hz)
    same = measure(
        small_inputs(store=alone, others={"b": there}), once(test_on=("b",)), "linear_plain"
    )
    for part in ("grouped", "on:b"):
        twin, own = scores(found, f"{part} 0-19 Hz"), scores(same, part)
        assert twin.numbers("value").tolist() == own.numbers("value").tolist()
        assert twin.column("metric") == own.column("metric") and own.rows
    told, noise = (
        scores(found, f"grouped {band}").where(metric="accuracy").numbers("value")[0]
        for band in ("0-19 Hz", "20-59 Hz")
    )
    assert told > 0.8 and noise < 0.6
    whole = measure(inputs, once(test_on=("b",)), "linear_plain")
    kept = [row for row in found.tables[0].rows if "Hz" not in row["part"]]
    assert kept == list(whole.tables[0].rows)
    assert set(found.cost[0].column("part")) == {
        "cost of grouped", "cost of grouped 0-19 Hz", "cost of grouped 20-59 Hz"
    }  # fmt: skip


def hz_of(others):
    return others["b"].frequency_hz


def test_numbers_have_twins_of_withheld_and_all_values():
    inputs = small_inputs("regression", withhold=[10.0])
    found = measure(inputs, once(bands=((0.0, 19.0),)), "linear_plain")
    parts = set(found.tables[0].column("part"))
    assert {f"{part} 0-19 Hz" for part in ("grouped", "withheld", "overall")} < parts


def twinned():
    low = {
        f"grouped {band}": ({"rmse": Score(mean, 0.1, (mean, mean))}, 8.2)
        for band, mean in (("60-6000 Hz", 2.0), ("60-1200 Hz", 5.5))
    }
    knn = size_result("knn", "k-NN", parts=low)
    return sizes(
        size_result(parts=low), knn,
        settings=Settings(bands=BANDS), papers={"known": paper_figure("size-known", 2.1)},
    )  # fmt: skip


def test_twins_stand_beside_the_paper_with_verdicts_of_their_own():
    (row,) = EXPERIMENT.paper_comparison(twinned(), lambda *_: None)
    assert row.result == "2.2 (1.75 to 2.65) mm" and row.agrees == "agrees"
    assert [twin.band for twin in row.twins] == ["60–6,000 Hz", "60–1,200 Hz"]
    assert [twin.result for twin in row.twins] == ["2 (1.85 to 2.15) mm", "5.5 (5.35 to 5.65) mm"]
    assert [twin.agrees for twin in row.twins] == ["agrees", "worse"]
    (plain,) = EXPERIMENT.paper_comparison(sizes(), lambda *_: None)
    assert plain.twins == ()


def test_the_figure_shows_each_model_from_each_band():
    (shown,) = (one for one in EXPERIMENT.figures(twinned()) if one.name.endswith("--bands"))
    drawn = styled(shown.draw)()
    (axes,) = drawn.axes
    assert [bars.lines[0].get_xdata().tolist() for bars in axes.containers] == [
        [2.2, 2.0, 5.5], [2.2, 2.0, 5.5],
    ]  # fmt: skip
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == ["whole band", "60–6,000 Hz", "60–1,200 Hz"]
    assert fits(drawn)
    assert not [one for one in EXPERIMENT.figures(sizes()) if one.name.endswith("--bands")]
