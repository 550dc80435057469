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
    """Sorts in a row on new grasps, by what was trained on and how many looks there are."""
    head = ("model", "trained on", "looks, at most", "sorts in a row", "expected",
            "in doubt", "into a wrong bin", "added to a sort")  # fmt: skip
    rows = []
    for model in ("cnn", "linear"):
        tables = results.experiment(DATASET, TASK, f"live_sorting-{model}")
        label = model_label(model, "classification")
        rows += [[label, *line] for line in _lines(tables)]
    return markdown_table(head, rows)


def _lines(tables: dict[str, Table]) -> list[list[str]]:
    """Return a line for each size of training and number of looks, had as needed."""
    which = {"part": "plain", "policy": "as needed"}
    lines = []
    for row in tables["conditions"].where(**which).rows:
        of = {"grasps": row["grasps"], "looks": row["looks"]}
        low, middle, high = np.percentile(
            tables["runs"].where(**which, **of).numbers("sorts"), PERCENTILES
        )
        (told,) = tables["offline"].where(part="plain", grasps=row["grasps"]).rows
        expected = f"{number(told['middle'])} ({number(told['low'])} to {number(told['high'])})"
        lines.append(
            [
                f"{row['grasps']} grasps each", str(row["looks"]),
                f"{number(middle)} ({number(low)} to {number(high)})",
                expected if row["looks"] == 1 else "",
                f"{number(100 * (1 - row['accepted']))} %", f"{number(100 * row['wrong'])} %",
                f"{number(row['added_s'])} s",
            ]
        )  # fmt: skip
    return lines


def sort_live(results: Results) -> str:
    """Runs through the simulated sound card: lengths, agreement, times of the stages."""
    about, tables = results.sort_live()
    runs, stages = tables["runs"], tables["stages"]
    rows = [
        _row(str(looks), runs.where(looks=looks), about["compared"][str(looks)])
        for looks in dict.fromkeys(runs.column("looks"))
    ]
    head = ("looks, at most", "runs", "sorts in a row", "into a wrong bin", "all sorted",
            "looks compared", "largest difference of a probability", "other decisions")  # fmt: skip
    what = f"{model_label(about['model'], 'classification')}, {about['placements']} placements."
    return f"{what}\n\n{markdown_table(head, rows)}\n{study_table(stages)}"


def _row(looks: str, runs: Table, compared: dict[str, Any]) -> list[str]:
    low, middle, high = np.percentile(runs.numbers("sorts"), PERCENTILES)
    return [
        looks, str(len(runs.rows)), f"{number(middle)} ({number(low)} to {number(high)})",
        str(sum(runs.column("mistakes"))), str(sum(runs.column("finished"))),
        value(compared["looks"]), value(compared["largest"]), value(compared["other_decisions"]),
    ]  # fmt: skip
