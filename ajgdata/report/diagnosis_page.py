"""Page of own data: object or placement, two sounds, and the plan of the next session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ajgdata.paths import TABLES_FOLDER
from ajgdata.report.render import DrawnFigure
from ajgdata.report.report_data import Diagnosis, Report


class TaskDiagnosis(NamedTuple):
    """The diagnosis of a task, its drawn figure, and the link to the plan as CSV."""

    task: Diagnosis
    figure: DrawnFigure
    plan_link: str


@dataclass(frozen=True)
class DiagnosisView:
    """Values of the template."""

    tasks: list[TaskDiagnosis]


def diagnosis_view(report: Report, figures: Mapping[str, DrawnFigure]) -> DiagnosisView:
    """Return the values of the page; `figures` are those of the report by name."""
    tasks = [
        TaskDiagnosis(
            task, figures[task.figure.name], f"{TABLES_FOLDER}/{task.plan_table.name}.csv"
        )
        for task in report.diagnoses
    ]
    return DiagnosisView(tasks)
