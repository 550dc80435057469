"""Novel objects: how many held-out objects each detector flags, against false alarms."""

from __future__ import annotations

from typing import Any

from threadpoolctl import threadpool_limits

from ajgdata.evaluate.intervals import mean_interval
from ajgdata.evaluate.novelty import novel_scores
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.evaluate.task_data import column_labels, grasp_names
from ajgdata.experiments.base import Experiment, Inputs, Outcome, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import NovelObjectsSettings
from ajgdata.report.format import number
from ajgdata.types.table import table_of

TITLE = "Novel objects"
#: The detector of a trained model, which combines two other detectors.
GUARD = "guard"
#: Titles of detectors, in the order of the figure.
DETECTORS = {
    GUARD: "guard of trained models",
    "nearest": "distance to the nearest grasp",
    "relative": "relative Mahalanobis distance",
    "mahalanobis": "Mahalanobis distance to the nearest object",
    "reconstruction": "reconstruction error of PCA",
    "energy": "energy score",
    "probability": "largest probability",
}
#: False-alarm rates of the curves.
RATES = (0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
#: Classifier of the energy score and the largest probability.
CLASSIFIER = "linear_plain"


def measure(inputs: Inputs, settings: NovelObjectsSettings, _: str) -> Outcome:
    """Return the share of grasps of held-out objects that each detector flags."""
    data = inputs.all_data()
    grasp = grasp_names(inputs.store, data)
    objects = column_labels(inputs.store, data, "object")
    with threadpool_limits(limits=1):
        scores = novel_scores(
            data.feature, grasp, data.group, objects, classifier=CLASSIFIER, seed=inputs.seed
        )

    def rates(name: str, rate: float) -> dict[str, float]:
        """Return the false-alarm rate of each detector that `name` combines."""
        return scores.guard_rates(rate) if name == GUARD else {name: rate}

    curve: list[dict[str, Any]] = []
    summary: list[dict[str, Any]] = []
    rows: list[ScoreRow] = []
    for name, title in DETECTORS.items():
        if name != GUARD and name not in scores.known:
            continue
        for rate in RATES:
            curve.append(
                {"detector": title, "rate": rate, "detected": scores.detected(rates(name, rate))}
            )
        at_rate = rates(name, settings.false_alarm)
        detected = scores.detected(at_rate)
        flags = scores.flags(at_rate).astype(float)
        low, high = mean_interval(flags, scores.novel_object, is_share=True, seed=inputs.seed)
        summary.append(
            {"key": name, "detector": title, "detected": detected, "low": low, "high": high}
        )
        key = ScoreKey("", *part_columns(GROUPED, inputs.dataset), condition=name)
        rows.append(ScoreRow("detection_rate", "pooled", detected, key))
        if name != GUARD:
            rows.append(ScoreRow("roc_area", "pooled", scores.area(name), key))
    curve += [{"detector": "chance", "rate": rate, "detected": rate} for rate in RATES]
    curve_columns = {"detector": "Detector", "rate": "False alarms", "detected": "Detected"}
    summary_columns = {
        "key": "Key",
        "detector": "Detector",
        "detected": "Detected",
        "low": "Lower end of the 95 % interval over objects",
        "high": "Upper end",
    }
    return Outcome(
        (
            score_table(rows, TITLE),
            table_of("curve", "Detected novel objects", curve, **curve_columns),
            table_of("detectors", "Detectors", summary, **summary_columns),
        )
    )


def finding(results: TaskResults) -> str:
    """Return the detection rate of the shipped guard, and that of the best single detector."""
    (result,) = results.results
    rows = {row["key"]: row for row in result.tables["detectors"].rows}
    guard = rows.pop(GUARD)
    rate, low, high = (f"{100 * guard[key]:.0f}" for key in ("detected", "low", "high"))
    best = max(rows, key=lambda name: rows[name]["detected"])
    alarms = number(100 * results.settings.false_alarm)
    return (
        f"{rate} % ({low} to {high}) of novel objects detected at {alarms} % false alarms; "
        f"best alone {100 * rows[best]['detected']:.0f} % ({best})"
    )


CURVE_PLOT = Plot(
    "lines",
    "curve",
    "share of grasps of held-out objects that are flagged, against the share of held-out grasps of "
    "known objects that may be flagged; the interval in the title is over objects",
    value="detected",
    x="rate",
    series=("detector",),
    cells={"detector": "label"},
    over="",
    percent=("detected", "rate"),
    title=finding,
)
EXPERIMENT = Experiment(
    BUILT_IN["novel_objects"],
    measure=measure,
    plots=(CURVE_PLOT,),
)
