"""Blocks on the sorting row: the experiment, and the same through a simulated sound card."""

from typing import Any

import numpy as np

from ajgdata.models import model_label
from ajgdata.report.format import number, value
from ajgdata.types.table import Table

from .markdown import markdown_table, study_table
from .results import Results

DATASET, TASK = "ycb", "sorting"
PERCENTILES = (5, 50, 95)


def live_sorting(results: Results) -> str:
    """Return both results of runs on new grasps, by training data and number of looks."""
    head = (
        "model", "trained on", "looks, at most", "sorted before the first error", "expected",
        "sorted by the paper's rule", "uncertain", "in a wrong bin", "added to a sort",
    )  # fmt: skip
    rows = []
    for model in ("cnn", "linear"):
        tables = results.experiment(DATASET, TASK, f"live_sorting-{model}")
        label = model_label(model, "classification")
        rows += [[label, *line] for line in _lines(tables)]
    return markdown_table(head, rows)


def _lines(tables: dict[str, Table]) -> list[list[str]]:
    """Return one line per size of the training data and number of looks, as needed."""
    which = {"part": "plain", "policy": "as needed"}
    lines = []
    for row in tables["conditions"].where(**which).rows:
        of = {"grasps": row["grasps"], "looks": row["looks"]}
        runs = tables["runs"].where(**which, **of)
        (offline,) = tables["offline"].where(part="plain", grasps=row["grasps"]).rows
        expected = _spread(offline["low"], offline["middle"], offline["high"])
        lines.append(
            [
                f"{row['grasps']} grasps each", str(row["looks"]),
                _spread(*np.percentile(runs.numbers("before_error"), PERCENTILES)),
                expected if row["looks"] == 1 else "",
                _spread(*np.percentile(runs.numbers("sorts"), PERCENTILES)),
                f"{number(100 * (1 - row['accepted']))} %", f"{number(100 * row['wrong'])} %",
                f"{number(row['added_s'])} s",
            ]
        )  # fmt: skip
    return lines


def _spread(low: float, middle: float, high: float) -> str:
    return f"{number(middle)} ({number(low)} to {number(high)})"


def sort_live(results: Results) -> str:
    """Runs through the simulated sound card: lengths, agreement, times of the stages."""
    about, tables = results.sort_live()
    runs, stages = tables["runs"], tables["stages"]
    rows = [
        _row(str(looks), runs.where(looks=looks), about["compared"][str(looks)])
        for looks in dict.fromkeys(runs.column("looks"))
    ]
    head = ("looks, at most", "runs", "sorted by the paper's rule", "in a wrong bin", "all sorted",
            "looks compared", "largest difference of a probability", "other decisions")  # fmt: skip
    what = f"{model_label(about['model'], 'classification')}, {about['placements']} placements."
    return f"{what}\n\n{markdown_table(head, rows)}\n{study_table(stages)}"


def _row(looks: str, runs: Table, compared: dict[str, Any]) -> list[str]:
    return [
        looks, str(len(runs.rows)), _spread(*np.percentile(runs.numbers("sorts"), PERCENTILES)),
        str(sum(runs.column("mistakes"))), str(sum(runs.column("finished"))),
        value(compared["looks"]), value(compared["largest"]), value(compared["other_decisions"]),
    ]  # fmt: skip
