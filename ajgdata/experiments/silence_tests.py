"""Tests of models on recordings with the speaker silent: p values corrected for one page.

The experiment `shortcut` shows them, and the comparison of cross-validation with the paper uses
them.
"""

from __future__ import annotations

from ajgdata.evaluate.fold_tests import holm
from ajgdata.evaluate.shortcut_test import FLAG_LEVEL
from ajgdata.experiments.base import Result, TaskResults


def silence_tests(results: TaskResults) -> list[tuple[Result, dict]]:
    """Return the tests on silence, rows of the table `silence`, each with its model's result.

    p values are corrected for all tests on the page (Holm), and decide which model is flagged.
    """
    rows = [
        (result, row)
        for task in results.same_page or (results,)
        for result in task.results
        for row in result.tables["silence"].rows
    ]
    corrected = holm([float(row["p"]) for _, row in rows])
    return [
        (result, row | {"p": p, "flagged": p < FLAG_LEVEL, "tests": len(rows)})
        for (result, row), p in zip(rows, corrected, strict=True)
        if result in results.results
    ]
