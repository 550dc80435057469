"""Placement or object: accuracy by order, split and number of placements, with placebo."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from matplotlib.figure import Figure

from ajgdata.evaluate.parts import GROUPED, RANDOM, SESSIONS
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.cross_validation_results import ModelResult, models_of
from ajgdata.report.format import Caption, Score, number
from ajgdata.report.marks import FigureContent, Point, draw
from ajgdata.report.report_data import Illustration
from ajgdata.types import CROSS_VALIDATION, many
from ajgdata.types.table import Table, table_of

PAGE = "placement"
#: Splits of the figure, the most optimistic first, with their names.
SPLITS = {RANDOM: "random split", GROUPED: "held-out grasps", SESSIONS: "held-out sessions"}
REAL = "objects"
PLACEBO = "placebo"
TEXT = (
    "Accuracy (95 % interval over grasps) by split. Placebo: one object under the names of all"
    " classes, recorded by the same protocol; a dotted line is the nominal chance level. If the"
    " placebo is above this line, the model recognises the placement and the state of the bed."
)
COLUMNS = {
    "order": "Placements per session",
    "split": "Split",
    "recordings": "Recordings",
    "model": "Model",
    "value": "Accuracy, %",
    "low": "Low end of the 95 % interval, %",
    "high": "High end of the 95 % interval, %",
    "chance": "Chance level, %",
}


def figures(results: Sequence[TaskResults]) -> Iterator[Illustration]:
    """Yield the accuracy by split and number of placements, if a task has a placebo."""
    models = [
        models_of(task)[0]
        for task in results
        if task.page == PAGE and task.experiment == CROSS_VALIDATION
    ]
    models = [model for model in models if model.placebo() is not None and placements_of(model)]
    models.sort(key=placements_of)
    if not models:
        return
    table = placement_table(models)
    finding = conclusion(table)
    listed = "; ".join(
        f"{row['order']}, {row['split']}, {row['recordings']}: {number(float(row['value']), 3)} %"
        for row in table.rows
    )
    yield Illustration(
        "placement--accuracy",
        Caption(TEXT, f"{finding}. {listed}."),
        partial(draw_figure, models, table, finding),
        finding,
        table,
    )


def placements_of(model: ModelResult) -> int:
    """Return how often each object was placed in a session; 0 if it is unknown."""
    return int(model.result.about["design"]["placements"] or 0)


def order_of(model: ModelResult) -> str:
    """Return how often each object was placed in a session, in words."""
    return many(placements_of(model), "placement")


def placement_table(models: Sequence[ModelResult]) -> Table:
    """Return a row for each model, split, and for objects and placebo."""
    rows = []
    for model in models:
        for split, name in SPLITS.items():
            scores = {REAL: model.with_interval(split) if model.has(split) else None}
            scores[PLACEBO] = model.placebo(split)
            for recordings, score in scores.items():
                if score is not None:
                    rows.append(
                        {
                            "order": order_of(model),
                            "split": name,
                            "recordings": recordings,
                            "model": model.label,
                            "value": 100 * score.mean,
                            "low": 100 * score.low,
                            "high": 100 * score.high,
                            "chance": 100 * model.chance(),
                        }
                    )
    return table_of("placement", "Accuracy by split and placements", rows, **COLUMNS)


def conclusion(table: Table) -> str:
    """Return the placebo's accuracy on held-out grasps with the fewest and the most placements.

    Identical objects count as recognised if the interval of the first value is above chance.
    """
    rows = table.where(split=SPLITS[GROUPED], recordings=PLACEBO).rows
    texts = [f"{number(float(row['value']), 2)} % with {row['order']}" for row in rows]
    ends = list(dict.fromkeys([texts[0], texts[-1]]))
    chance = number(float(rows[0]["chance"]), 2)
    is_recognised = float(rows[0]["low"]) > float(rows[0]["chance"])
    subject = "Identical objects are “recognised”" if is_recognised else "Placebo"
    return f"{subject}: {', '.join(ends)} (chance {chance} %)"


def draw_figure(models: Sequence[ModelResult], table: Table, title: str) -> Figure:
    """Draw a panel per number of placements: accuracy of objects and placebo by split."""
    points = []
    for row in table.rows:
        value, low, high = (float(row[key]) for key in ("value", "low", "high"))
        score = Score(value, 0.0, (), low, high)
        points.append(Point(str(row["order"]), str(row["recordings"]), str(row["split"]), score))
    levels = {str(row["order"]): float(row["chance"]) for row in table.rows}
    content = FigureContent(
        title=title,
        subtitle=f"{models[0].task.dataset_title}, {models[0].label}",
        sources=(models[0].task.source,),
        points=tuple(points),
        axis=("accuracy", "%"),
        chance=tuple(levels.items()),
        limits=(0.0, 100.0),
    )
    return draw("rows", content)
