"""`python -m tools.feature_page`: write the tables and the figure of docs/which-feature.md.

All numbers come from docs/which-feature.json, which `benchmarks/feature_scores.py` measures.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import t as student

from ajgdata.evaluate.fold_tests import SIGNIFICANCE_LEVEL, corrected_deviation, holm
from ajgdata.evaluate.intervals import ROUNDING
from ajgdata.report.canvas import WIDTH_IN, encode, line_style, new_figure, styled
from ajgdata.report.format import DASH, number, with_unit
from ajgdata.store.files import write_if_changed

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE = DOCS / "which-feature.md"
RESULTS = DOCS / "which-feature.json"
FIGURE = DOCS / "images" / "which-feature.svg"
#: Title of the figure, and of the page.
TITLE = "No feature is significantly better than the spectrum"
#: The feature with which the others are compared.
REFERENCE = "spectrum"
FEATURES = (REFERENCE, "spectrogram", "mel", "transfer_function")
#: Models of each feature.
MODELS = ("ridge", "knn_plain")
#: Largest gain or loss without importance, as a share of the distance from chance to perfect.
MARGIN = 0.125
#: Smallest number of folds, or of data sets, of a test. An interval of two values would be wider
#: than all possible gains.
LEAST_VALUES = 3
#: Labels of the predicted columns, with their unit.
TARGETS = {
    ("active_rp", "label"): ("surface", "%"),
    ("knock_material", "material"): ("material", "%"),
    ("stone_impact", "form"): ("form", "%"),
    ("stone_impact", "mass_ini"): ("mass", "g"),
    ("esc10", "label"): ("sound", "%"),
    ("mini_tapsense", "tap"): ("tap", "%"),
    ("sound_folders", "folder"): ("folder", "%"),
    ("sphere80", "material"): ("material", "%"),
    ("sphere30", "material"): ("material", "%"),
    ("plate", "material"): ("material", "%"),
    ("orientation", "angle_deg"): ("direction", "°"),
    ("size", "edge_mm"): ("edge", "mm"),
    ("ycb", "object"): ("object", "%"),
}
#: What is held out, by column of the groups. Recordings of other laboratories have no grasps.
HELD_OUT = {
    "grasp_id": "recordings",
    "session_id": "sessions",
    "sample_name": "stones",
    "fold": "published folds",
}
#: What is new in the data sets that models were not trained on.
TEST_SETS = {
    "size_80dba": "grasps in noise, 80 dB(A)",
    "size_moved_transducers": "gripper with moved transducers",
    "ycb_moved_transducers": "gripper with moved transducers",
    "ycb_other_membrane": "gripper with another membrane",
}


class Estimate(NamedTuple):
    """Mean gain of a feature over the reference, before the correction for several tests.

    The gain is a share of the distance from chance to perfect. The standard `deviation` of the mean
    is NaN without a test.
    """

    gain: float
    deviation: float
    degrees: int  #: degrees of freedom of Student's t


class Gain(NamedTuple):
    """Gain of a feature over the reference, as a share of the distance from chance to perfect.

    The interval and the p value are corrected for all tests of the table.
    """

    gain: float
    low: float
    high: float
    p: float

    @property
    def verdict(self) -> str:
        """Return whether the feature is better or worse than the reference."""
        if math.isnan(self.p):
            return "equal" if self.gain == 0 else "no test"
        if self.p < SIGNIFICANCE_LEVEL:
            return "better" if self.gain > 0 else "worse"
        if self.low > -MARGIN and self.high < MARGIN:
            return "no difference"
        return "inconclusive"


class Family(NamedTuple):
    """Scores with one source of recordings and one kind of split."""

    source: str
    is_new_condition: bool  #: held-out sessions or another gripper, not grasps of one session

    @property
    def name(self) -> str:
        """Return the name of the family in the table."""
        held_out = (
            "sessions, grippers, noise" if self.is_new_condition else "recordings, stones, grasps"
        )
        return f"*{self.source}*, {held_out}"

    def has(self, row: dict[str, Any]) -> bool:
        """Return whether a row of scores belongs to the family."""
        is_new = bool(row["test_set"]) or row["held_out"] == "session_id"
        return row["source"] == self.source and is_new == self.is_new_condition


FAMILIES = tuple(
    Family(source, is_new) for source in ("recorded", "simulated") for is_new in (False, True)
)


def skill(row: dict[str, Any], value: float) -> float:
    """Return a score on the axis from 0 (chance level) to 1 (perfect)."""
    return (value - row["chance"]) / (row["perfect"] - row["chance"])


def score(row: dict[str, Any], feature: str, model: str | None = None) -> float:
    """Return the score of a feature with one model, or with both."""
    values = row["features"][feature]
    return values["value"] if model is None else values["per_model"][model]


def is_tested(row: dict[str, Any]) -> bool:
    """Return whether the folds of a row of scores are tested.

    Two folds are too few. The folds of another data set all predict the same recordings, but the
    test assumes that each fold has its own recordings.
    """
    folds = len(row["features"][REFERENCE]["per_fold"])
    return not row["test_set"] and folds >= LEAST_VALUES


def fold_gains(scores: Sequence[dict[str, Any]]) -> dict[tuple[int, str], Gain]:
    """Return the gain of each feature in each tested row of scores, by index of the row.

    A test compares the folds in pairs, with the deviation of Nadeau and Bengio.
    """
    estimates = {}
    for index, row in enumerate(scores):
        if not is_tested(row):
            continue
        reference = row["features"][REFERENCE]["per_fold"]
        for feature, values in row["features"].items():
            if feature != REFERENCE:
                gains = [
                    skill(row, after) - skill(row, before)
                    for before, after in zip(reference, values["per_fold"], strict=True)
                ]
                estimates[index, feature] = estimate(gains, 1 / (len(gains) - 1))
    return dict(zip(estimates, corrected(list(estimates.values())), strict=True))


def dataset_gains(
    scores: Sequence[dict[str, Any]], family: Family, feature: str, model: str | None = None
) -> list[float]:
    """Return the gain of a feature on each data set of a family, with one model or with both.

    The rows of a data set count as one.
    """
    by_dataset: dict[str, list[float]] = {}
    for row in scores:
        if family.has(row) and feature in row["features"]:
            gain = skill(row, score(row, feature, model)) - skill(row, score(row, REFERENCE, model))
            by_dataset.setdefault(row["dataset"], []).append(gain)
    return [float(np.mean(gains)) for gains in by_dataset.values()]


def family_gains(
    scores: Sequence[dict[str, Any]],
) -> dict[tuple[Family, str], tuple[int, Gain]]:
    """Return the number of data sets, and the mean gain over them, of each family and feature."""
    values = {
        (family, feature): dataset_gains(scores, family, feature)
        for family in FAMILIES
        for feature in FEATURES[1:]
    }
    values = {key: gains for key, gains in values.items() if len(gains) > 1}
    gains = corrected([estimate(gains) for gains in values.values()])
    return {key: (len(values[key]), gain) for key, gain in zip(values, gains, strict=True)}


def estimate(gains: Sequence[float], test_share: float = 0.0) -> Estimate:
    """Return the mean of gains (n,) with its standard deviation (see `corrected_deviation`).

    There is no deviation with fewer gains than `LEAST_VALUES`, or if all are equal.
    """
    count = len(gains)
    mean = float(np.mean(gains))
    if count < LEAST_VALUES or np.ptp(gains) <= ROUNDING:
        return Estimate(mean, math.nan, count - 1)
    deviation = corrected_deviation(float(np.var(gains, ddof=1)), count, test_share)
    return Estimate(mean, deviation, count - 1)


def corrected(estimates: Sequence[Estimate]) -> list[Gain]:
    """Return gains with intervals and p values that are corrected for the number of tests.

    The intervals are those of Bonferroni: all contain their true gain with a probability of 95 %.
    The p values are those of Holm.

    >>> from tools.feature_page import corrected, estimate
    >>> (gain,) = corrected([estimate([0.1, 0.2, 0.3])])  # 0.2 ± 4.30 * 0.1 / sqrt(3)
    >>> f"{gain.low:.2f} {gain.high:.2f} {gain.p:.3f}"
    '-0.05 0.45 0.074'
    >>> gain, _ = corrected([estimate([0.1, 0.2, 0.3])] * 2)  # 0.2 ± 6.21 * 0.1 / sqrt(3)
    >>> f"{gain.low:.2f} {gain.high:.2f} {gain.p:.3f}"
    '-0.16 0.56 0.148'
    """
    tests = sum(math.isfinite(part.deviation) for part in estimates)
    p = holm([float(2 * student.sf(abs(e.gain) / e.deviation, e.degrees)) for e in estimates])
    gains = []
    for part, corrected_p in zip(estimates, p, strict=True):
        tail = SIGNIFICANCE_LEVEL / 2 / max(tests, 1)
        reach = float(student.ppf(1 - tail, part.degrees)) * part.deviation
        gains.append(Gain(part.gain, part.gain - reach, part.gain + reach, corrected_p))
    return gains


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def gain_text(gain: Gain) -> str:
    """Return a gain with its interval, in hundredths."""
    if math.isnan(gain.low):
        return hundredths(gain.gain)
    return f"{hundredths(gain.gain)} ({hundredths(gain.low)} to {hundredths(gain.high)})"


def hundredths(gain: float) -> str:
    """Return a gain in hundredths of the distance from chance to perfect."""
    return f"{round(100 * gain, 1) + 0.0:.1f}".replace("-", "−")  # + 0.0 removes the sign of -0.0


def summary_table(results: dict[str, Any]) -> str:
    """Return the mean gains over data sets, of both models together and of each."""
    scores = results["scores"]
    rows = []
    for (family, feature), (count, gain) in family_gains(scores).items():
        per_model = [
            hundredths(float(np.mean(dataset_gains(scores, family, feature, model))))
            for model in MODELS
        ]
        cells = (str(count), *per_model, gain_text(gain), number(gain.p, 2), gain.verdict)
        rows.append((family.name, feature, *cells))
    models = [f"`{model}`" for model in MODELS]
    head = ("held out", "feature", "data sets", *models, "both (interval)", "p (Holm)", "verdict")
    return table(head, rows)


def score_table(results: dict[str, Any]) -> str:
    """Return the scores of all features in each row, of both models together."""
    gains = fold_gains(results["scores"])
    rows = []
    for index, row in enumerate(results["scores"]):
        _, unit = TARGETS[row["dataset"], row["target"]]
        cells = []
        for feature in FEATURES:
            values = row["features"].get(feature)
            if values is None:
                cells.append(DASH)
                continue
            text = score_text(values["value"], unit)
            if math.isfinite(values["low"]):
                low, high = (number(scale(unit) * values[end]) for end in ("low", "high"))
                text += f" ({low} to {high})"
            gain = gains.get((index, feature))
            if gain is not None and gain.verdict != "inconclusive":
                text += f", {gain.verdict}"
            cells.append(text)
        held_out = held_out_text(row)
        if not is_tested(row):
            held_out += ", *no test*"
        counts = f"{row['recordings']}, {row['units']}"
        rows.append((name_text(row), held_out, counts, score_text(row["chance"], unit), *cells))
    head = ("data set, target", "held out", "recordings, groups", "chance level", *FEATURES)
    return table(head, rows)


def model_table(results: dict[str, Any], model: str) -> str:
    """Return the scores of all features with one model."""
    rows = []
    for row in results["scores"]:
        _, unit = TARGETS[row["dataset"], row["target"]]
        cells = [
            score_text(score(row, feature, model), unit) if feature in row["features"] else DASH
            for feature in FEATURES
        ]
        rows.append((name_text(row), held_out_text(row), score_text(row["chance"], unit), *cells))
    return table(("data set, target", "held out", "chance level", *FEATURES), rows)


def name_text(row: dict[str, Any]) -> str:
    """Return the data set and the target of a row of scores."""
    target, _ = TARGETS[row["dataset"], row["target"]]
    name = f"{row['dataset']}, {target}"
    return f"{name} (*simulated*)" if row["source"] == "simulated" else name


def score_text(value: float, unit: str) -> str:
    """Return a score with its unit."""
    return with_unit(number(scale(unit) * value), unit)


def scale(unit: str) -> int:
    """Return the factor from a score to its printed number."""
    return 100 if unit == "%" else 1


def cost_table(results: dict[str, Any]) -> str:
    """Return the number of values and the CPU times relative to the reference."""
    rows = []
    for feature in FEATURES:
        measured = [cost for cost in results["costs"] if feature in cost["features"]]
        if not measured:
            continue
        values = [cost["features"][feature]["values"] for cost in measured]
        times = [
            cost["features"][feature]["cpu_s"] / cost["features"][REFERENCE]["cpu_s"]
            for cost in measured
        ]
        training = [
            row["features"][feature]["train_cpu_s"] / row["features"][REFERENCE]["train_cpu_s"]
            for row in results["scores"]
            if feature in row["features"] and not row["test_set"]
        ]
        rows.append((feature, span(values), spread(times), spread(training)))
    head = ("feature", "values per recording", "CPU time of a feature", "CPU time of training")
    return table(head, rows)


def span(values: Sequence[int]) -> str:
    """Return the smallest and the largest of some numbers."""
    if min(values) == max(values):
        return f"{values[0]:,}"
    return f"{min(values):,} to {max(values):,}"


def spread(ratios: Sequence[float]) -> str:
    """Return the median, the smallest and the largest of ratios."""
    if max(ratios) == 1:
        return "1"
    median, low, high = (number(float(f(ratios)), 2) for f in (np.median, min, max))
    return f"{median} ({low} to {high})"


def figure(results: dict[str, Any]) -> Figure:
    """Return the scores of all features on the axis from chance level to perfect."""
    scores = results["scores"]
    sources = ("recorded", "simulated")
    most = max(sum(row["source"] == source for row in scores) for source in sources)
    size = (1.4 * WIDTH_IN, 1.3 + 0.42 * most)
    subtitle = "Skill: 0 is the chance level, 1 is perfect. Bars: 95 % interval over groups."
    drawn = new_figure(size, TITLE, subtitle, sources)
    grid = drawn.subplots(1, 2, sharex=True)
    for axes, source in zip(grid, sources, strict=True):
        rows = [row for row in scores if row["source"] == source]
        for number_of, feature in enumerate(FEATURES):
            shift = 0.17 * (number_of - (len(FEATURES) - 1) / 2)
            points = [
                (place + shift, *(skill(row, row["features"][feature][key]) for key in KEYS))
                for place, row in enumerate(rows)
                if feature in row["features"]
            ]
            if not points:
                continue
            y, value, *ends = np.array(points).T
            low = np.fmin(*ends)
            high = np.fmax(*ends)
            bars = np.nan_to_num(np.stack([value - low, high - value]))
            style = {**line_style(number_of), "ls": "", "capsize": 1.5, "elinewidth": 0.8}
            axes.errorbar(value, y, xerr=np.maximum(bars, 0), label=feature, **style)
        axes.axvline(0, color="black", lw=0.8)
        axes.set_yticks(range(len(rows)), [row_label(row) for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlim(-0.5, 1.05)
        axes.grid(False, axis="y")
        axes.set_title(source, fontsize=9)
        axes.set_xlabel("skill")
    drawn.legend(*grid[1].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawn


#: Values of a feature in a row of scores: the mean, and the ends of its interval.
KEYS = ("value", "low", "high")


def row_label(row: dict[str, Any]) -> str:
    """Return the label of a row of the figure."""
    target, _ = TARGETS[row["dataset"], row["target"]]
    return f"{row['dataset']}, {target}\n{held_out_text(row)}"


def held_out_text(row: dict[str, Any]) -> str:
    """Return what a row of scores holds out."""
    if row["test_set"]:
        return TEST_SETS[row["test_set"]]
    if row["held_out"] == "grasp_id" and row["source"] == "simulated":
        return "grasps"
    return HELD_OUT[row["held_out"]]


TABLES = {
    "summary": summary_table,
    "scores": score_table,
    **{model: partial(model_table, model=model) for model in MODELS},
    "costs": cost_table,
}


def page_with_tables(text: str, results: dict[str, Any]) -> str:
    """Return the text of the page with the tables of `results` between its markers."""
    for name, make in TABLES.items():
        block = f"<!-- {name} -->\n\n{make(results)}\n<!-- /{name} -->"
        pattern = rf"<!-- {name} -->.*?<!-- /{name} -->"
        text = re.sub(pattern, lambda _, block=block: block, text, flags=re.DOTALL)
    return text


def main() -> None:
    """Write the tables into the page, and the figure."""
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    text = page_with_tables(PAGE.read_text(encoding="utf-8"), results)
    drawn = styled(figure)(results)
    for file, content in ((PAGE, text.encode()), (FIGURE, encode(drawn, "svg"))):
        if write_if_changed(file, content):
            print(f"wrote {file}")


if __name__ == "__main__":
    main()
