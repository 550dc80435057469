"""`python -m tools.readme_table [--results DIR]`: write the table of results into the README."""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from ajgdata.evaluate.agreement import (
    GRASP_INTERVAL,
    NO_BETTER,
    Estimate,
    Interval,
    placebo_test,
)
from ajgdata.paths import Paths
from ajgdata.pipeline.report_content import published_values
from ajgdata.report.comparison import NEAR_CHANCE, PaperFigure, judged
from ajgdata.report.format import DASH, number, with_unit
from ajgdata.store.files import write_if_changed
from ajgdata.store.metrics import read_metrics
from ajgdata.store.sessions import read_dataset

#: The project of this README. `--results` can be a folder of another project.
PROJECT = Paths(Path(__file__).resolve().parents[1])
README = PROJECT.root / "README.md"
# Markers before and after the table.
BEGIN = "<!-- results -->\n"
END = "<!-- /results -->\n"
#: Statistics of repeated fits: value, and ends of the interval.
REPEATED = ("median", "low", "high")
HEAD = (
    "CNN",
    "simulated (95 % interval)",
    "held-out sessions",
    "placebo",
    "chance level",
    "paper",
    "verdict",
)


class Row(NamedTuple):
    """A row of the table: scores of the CNN on a task, and a published value."""

    title: str
    dataset: str
    task: str
    query: str  #: condition on the rows of metrics.csv with the scores
    paper: str  #: name of the published value
    sessions: str = ""  #: condition on the rows with the scores of held-out sessions


_CROSS_VALIDATION = "experiment == 'cross_validation' and split == 'grouped'"
_HELD_OUT = f"{_CROSS_VALIDATION} and target_values == 'training'"
_WITHHELD = f"{_CROSS_VALIDATION} and target_values == 'withheld'"
_SESSIONS = "experiment == 'cross_validation' and split == 'session'"
_IN_SESSIONS = f"{_SESSIONS} and target_values == 'training'"
_WITHHELD_IN_SESSIONS = f"{_SESSIONS} and target_values == 'withheld'"
_PLACEBO = f"{_CROSS_VALIDATION} and target_values == 'placebo'"
_IN_NOISE = "experiment == 'repeated_fits' and test_set == 'size_80dba'"
#: Each title is understandable without the other rows.
ROWS = (
    Row("Edge length of a cube, RMSE", "size", "size", _HELD_OUT, "size-known", _IN_SESSIONS),
    Row(
        "Edge length in noise of 80 dB(A), training at 45 dB(A), RMSE",
        "size",
        "noise",
        _IN_NOISE,
        "noise",
    ),
    Row("Household object, 16 classes, accuracy", "ycb", "object", _HELD_OUT, "ycb", _IN_SESSIONS),
    Row(
        "Material of an 80 mm sphere, 4 classes, accuracy",
        "sphere80",
        "material",
        _HELD_OUT,
        "materials-sphere80",
        _IN_SESSIONS,
    ),
    Row(
        "Angle of a bar, angles withheld from training, RMSE",
        "orientation",
        "angle",
        _WITHHELD,
        "orientation",
        _WITHHELD_IN_SESSIONS,
    ),
)


class Values(NamedTuple):
    """A score of the CNN. Its numbers, multiplied by `scale`, have the unit `unit`."""

    score: Estimate
    unit: str
    scale: float

    @property
    def text(self) -> str:
        """Return the value with its unit."""
        return with_unit(number(self.scale * self.score.value), self.unit)


def readme_table(metrics: Path) -> str:
    """Return the table for a `metrics.csv`, with the commit of the run and the hash of the file."""
    numbers = read_metrics(metrics)
    paper = published_values(PROJECT)
    lines = [HEAD, tuple("---" for _ in HEAD)]
    lines += [_cells(row, numbers, paper[row.paper]) for row in ROWS]
    table = "".join(f"| {' | '.join(cells)} |\n" for cells in lines)
    commits = ", ".join(sorted({commit[:10] for commit in numbers["commit"]}))
    digest = hashlib.sha256(metrics.read_bytes()).hexdigest()[:10]
    about = f"Commit {commits}; SHA-256 of `metrics.csv`: {digest}."
    return f"\n{table}\n{_machines(numbers, paper)}{about}\n\n"


def _machines(metrics: pd.DataFrame, paper: Mapping[str, PaperFigure]) -> str:
    """Return a line with the difference of each value between computers.

    The verdicts use these differences. Returns "" if none was measured
    (`reports/machine_spread.yaml`).
    """
    differences = []
    for row in ROWS:
        values = _values(row, metrics, row.query)
        spread = paper[row.paper].spread
        if values is not None and spread:
            differences.append(f"±{with_unit(number(spread, 2), values.unit)}")
    if not differences:
        return ""
    link = "[Other computers](docs/reproducibility.md#differences-between-computers)"
    return (
        "The report has the same numbers."
        f" {link} differ by {', '.join(differences)} (row by row).\n\n"
    )


def _cells(row: Row, metrics: pd.DataFrame, paper: PaperFigure) -> tuple[str, ...]:
    """Return the cells of a row; a dash for values that the run does not have."""
    values = _values(row, metrics, row.query)
    published = paper.text if paper.value is None else with_unit(number(paper.value), paper.unit)
    if values is None:
        return row.title, DASH, DASH, DASH, DASH, published, DASH
    score, unit, scale = values
    low, high = (number(scale * end) for end in score.interval)
    result = f"{values.text} ({low} to {high})"
    placebo = _values(row, metrics, _PLACEBO)
    is_better = score.is_better_than_chance
    if placebo is not None:
        is_better = placebo_test(score, placebo.score).is_better
    if not is_better:
        result += f", {NO_BETTER}"
    verdict: str = DASH
    if paper.value is not None or paper.text == NEAR_CHANCE:
        reference = score.chance if paper.value is None else paper.value / scale
        verdict = judged(paper, score, reference, scale=scale).verdict
    nominal = with_unit(number(scale * score.chance), unit)
    controls = (_control(row, metrics, query) for query in (row.sessions, _PLACEBO))
    return row.title, result, *controls, nominal, published, verdict


def _control(row: Row, metrics: pd.DataFrame, query: str) -> str:
    """Return a control of a row with its unit; a dash if there is none."""
    values = _values(row, metrics, query) if query else None
    return values.text if values else DASH


def _values(row: Row, metrics: pd.DataFrame, query: str) -> Values | None:
    """Return the values of a row that `query` selects; None if the run has none."""
    spec = read_dataset(PROJECT, row.dataset)
    target = spec.targets[spec.tasks[row.task].target]
    is_class = target.kind == "classification"
    if is_class:
        metric, unit, scale = "accuracy", "%", 100
    else:
        metric, unit, scale = "rmse", target.unit, 1
    task = f"dataset == '{row.dataset}' and task == '{row.task}' and model == 'cnn'"
    scores = metrics.query(f"{task} and metric == '{metric}' and {query}")
    values = scores.set_index("statistic")["value"]
    names = REPEATED if "median" in values else ("mean", *GRASP_INTERVAL)
    if names[0] not in values:
        return None
    middle, low, high = (float(values[name]) for name in names)
    chance = float(values["chance"])
    score = Estimate(middle, Interval(low, high), chance, perfect=float(is_class))
    return Values(score, unit, scale)


def written(text: str) -> str:
    """Return the text between the markers of the README."""
    return text.split(BEGIN)[1].split(END, maxsplit=1)[0]


def main() -> None:
    """Write the table into the README."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--results", type=Path, default=PROJECT.results)
    metrics = options.parse_args().results / PROJECT.metrics_table.name
    text = README.read_text(encoding="utf-8")
    table = readme_table(metrics)
    if write_if_changed(README, text.replace(written(text), table).encode()):
        print(f"wrote {README}")


if __name__ == "__main__":
    main()
