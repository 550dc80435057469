"""`python -m tools.feature_page`: write the tables and the figure of docs/which-feature.md.

All numbers come from docs/which-feature.json, which `benchmarks/feature_scores.py` measures.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import t as student

from ajgdata.evaluate.fold_tests import SIGNIFICANCE_LEVEL, holm, paired_fold_test
from ajgdata.evaluate.intervals import CONFIDENCE
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
#: An interval is narrow if it is below this share of the distance from chance to perfect.
NARROW = 0.25
#: Smallest number of data sets of an interval. That of two would be wider than all possible gains.
LEAST_DATASETS = 3
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


class Gain(NamedTuple):
    """Gain of a feature over the reference, as a share of the distance from chance to perfect."""

    gain: float
    low: float
    high: float
    p: float  #: corrected for all tests of the table

    @property
    def verdict(self) -> str:
        """Return whether the feature is better or worse than the reference."""
        if self.p < SIGNIFICANCE_LEVEL:
            return "better" if self.gain > 0 else "worse"
        if self.gain == 0 and math.isnan(self.p):
            return "equal"
        if self.low <= 0 <= self.high and self.high - self.low < NARROW:
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


def distance(row: dict[str, Any]) -> float:
    """Return the distance from the chance level to a perfect score."""
    return abs(row["perfect"] - row["chance"])


def skill(row: dict[str, Any], value: float) -> float:
    """Return a score on the axis from 0 (chance level) to 1 (perfect)."""
    return (value - row["chance"]) / (row["perfect"] - row["chance"])


def fold_gains(scores: Sequence[dict[str, Any]]) -> dict[tuple[int, str], Gain]:
    """Return the gain of each feature in each row of scores, with p values of Holm.

    A test compares the folds in pairs (`paired_fold_test`).
    """
    tests = {}
    for index, row in enumerate(scores):
        reference = row["features"][REFERENCE]["per_fold"]
        for feature, values in row["features"].items():
            if feature != REFERENCE:
                tests[index, feature] = paired_fold_test(
                    reference, values["per_fold"], metric=row["metric"], paired=True
                )
    corrected = holm([test.p for test in tests.values()])
    return {
        key: Gain(*(part / distance(scores[key[0]]) for part in test[:3]), p)
        for (key, test), p in zip(
            ((key, (test.gain, test.low, test.high)) for key, test in tests.items()),
            corrected,
            strict=True,
        )
    }


def family_gains(
    scores: Sequence[dict[str, Any]],
) -> dict[tuple[Family, str], tuple[int, Gain]]:
    """Return the number of data sets, and the mean gain over them, of each family and feature.

    The rows of a data set count as one. The interval is Student's t over data sets; with fewer than
    `LEAST_DATASETS` there is none.
    """
    values: dict[tuple[Family, str], list[float]] = {}
    for family in FAMILIES:
        for feature in FEATURES[1:]:
            by_dataset: dict[str, list[float]] = {}
            for row in scores:
                if family.has(row) and feature in row["features"]:
                    gain = skill(row, row["features"][feature]["value"])
                    gain -= skill(row, row["features"][REFERENCE]["value"])
                    by_dataset.setdefault(row["dataset"], []).append(gain)
            if len(by_dataset) > 1:
                values[family, feature] = [float(np.mean(gains)) for gains in by_dataset.values()]
    intervals = [mean_gain(gains) for gains in values.values()]
    corrected = holm([gain.p for gain in intervals])
    return {
        key: (len(values[key]), gain._replace(p=p))
        for key, gain, p in zip(values, intervals, corrected, strict=True)
    }


def mean_gain(gains: Sequence[float]) -> Gain:
    """Return the mean of gains (n,) with the interval and p value of Student's t.

    >>> from tools.feature_page import mean_gain
    >>> gain = mean_gain([0.1, 0.2, 0.3])  # 0.2 ± 4.30 * 0.1 / sqrt(3)
    >>> f"{gain.low:.2f} {gain.high:.2f} {gain.p:.3f}"
    '-0.05 0.45 0.074'
    """
    count = len(gains)
    mean = float(np.mean(gains))
    deviation = float(np.std(gains, ddof=1)) / math.sqrt(count)
    if count < LEAST_DATASETS or deviation == 0:
        return Gain(mean, math.nan, math.nan, math.nan)
    reach = float(student.ppf((1 + CONFIDENCE) / 2, count - 1)) * deviation
    p = float(2 * student.sf(abs(mean) / deviation, count - 1))
    return Gain(mean, mean - reach, mean + reach, p)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def gain_text(gain: Gain) -> str:
    """Return a gain with its interval, in hundredths of the distance from chance to perfect."""
    ends = (number(100 * end, 2).replace("-", "−") for end in (gain.gain, gain.low, gain.high))
    middle, low, high = ends
    if math.isnan(gain.low):
        return middle
    return f"{middle} ({low} to {high})"


def summary_table(results: dict[str, Any]) -> str:
    """Return the mean gains over data sets."""
    rows = [
        (family.name, feature, str(count), gain_text(gain), number(gain.p, 2), gain.verdict)
        for (family, feature), (count, gain) in family_gains(results["scores"]).items()
    ]
    head = ("held out", "feature", "data sets", "gain (95 % interval)", "p (Holm)", "verdict")
    return table(head, rows)


def score_table(results: dict[str, Any]) -> str:
    """Return the scores of all features in each row."""
    gains = fold_gains(results["scores"])
    rows = []
    for index, row in enumerate(results["scores"]):
        target, unit = TARGETS[row["dataset"], row["target"]]
        scale = 100 if unit == "%" else 1
        cells = []
        for feature in FEATURES:
            values = row["features"].get(feature)
            if values is None:
                cells.append(DASH)
                continue
            text = with_unit(number(scale * values["value"]), unit)
            if math.isfinite(values["low"]):
                low, high = (number(scale * values[end]) for end in ("low", "high"))
                text += f" ({low} to {high})"
            if feature != REFERENCE and gains[index, feature].verdict != "inconclusive":
                text += f", {gains[index, feature].verdict}"
            cells.append(text)
        name = f"{row['dataset']}, {target}"
        if row["source"] == "simulated":
            name += " (*simulated*)"
        held_out = held_out_text(row)
        counts = f"{row['recordings']}, {row['units']}"
        chance = with_unit(number(scale * row["chance"]), unit)
        rows.append((name, held_out, counts, chance, *cells))
    head = ("data set, target", "held out", "recordings, groups", "chance level", *FEATURES)
    return table(head, rows)


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


TABLES = {"summary": summary_table, "scores": score_table, "costs": cost_table}


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
