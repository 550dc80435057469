"""What the first page of a report says of the settings of the STFT."""

import pytest

from ajgdata.experiments import EXPERIMENTS
from ajgdata.experiments.base import Result, TaskResults, score_table
from ajgdata.experiments.stft_settings import Settings
from ajgdata.types.table import table_of

#: Window, hop, band; then ms a feature and errors in % of both models; the first is today's.
TRIED = (
    (2048, 512, None, 0.30, 30.0, 40.0),
    (2048, 1024, None, 0.20, 28.0, 41.0),
    (1024, 1024, None, 0.10, 33.0, 45.0),
    (2048, 512, (100, 6000), 0.31, 35.0, 39.0),
)


def stft(tried=TRIED, spread=0.03):
    models, rows, costs, settings = ("ridge", "knn"), [], [], []
    for window, hop, band, ms, *errors in tried:
        part = f"{window}/{hop}/{band}"
        low, high = band or (None, None)
        settings.append(
            {"part": part, "window": window, "hop": hop, "low_hz": low, "high_hz": high, "bins": 9}
        )
        for model, error in zip(models, errors, strict=True):
            told = {"mean": 1 - error / 100, "sd": spread, "chance": 0.1}
            rows += [(model, part, "accuracy", key, value) for key, value in told.items()]
            cost = "feature_s_per_recording", "measured", ms / 1e3
            costs.append((model, f"cost of {part}", *cost))
    keys = {key: key for key in settings[0]}
    found = (score_table(rows, "s"), table_of("settings", "s", settings, **keys))
    result = Result("", "", {}, {t.name: t for t in found}, {"scores": score_table(costs, "c")})
    return TaskResults(
        experiment="stft_settings", dataset="ycb", dataset_title="Objects", task="stft",
        kind="classification", target="object", unit="", groups="grasp_id", source="simulated",
        settings=Settings(settings=[{"hop": 1024}], models=models), results=(result,),
    )  # fmt: skip


@pytest.mark.parametrize("tried", [TRIED, TRIED[:1] + TRIED[2:3]])
def test_the_highlight_is_the_range_of_all_settings_and_never_the_best(tried):
    (highlight,) = EXPERIMENTS["stft_settings"].highlights(stft(tried))
    ours, own = highlight.marks
    errors = [one[4] for one in tried[1:]]  # of the first model, without the data set's own
    assert (ours.low, ours.high) == pytest.approx((min(errors), max(errors)))
    assert ours.value == pytest.approx(sum(errors) / len(errors))
    assert "exploratory" in highlight.said
    assert own.value == pytest.approx(30)
