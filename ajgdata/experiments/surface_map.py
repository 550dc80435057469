"""Map of true and predicted classes over two columns with positions: `map` of a task."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import partial

from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.experiments.base import TaskResults
from ajgdata.experiments.scores import POSITIONS, PREDICTIONS
from ajgdata.report.format import Caption, number
from ajgdata.report.report_data import Illustration
from ajgdata.report.surface_map import SurfacePoint, surface_map_figure


def surface_maps(results: TaskResults) -> Iterator[Illustration]:
    """Yield the map of each model, if the task requests maps."""
    if not results.task_settings.map:
        return
    for result in results.results:
        points = points_of(results, result.model)
        positions = result.tables[POSITIONS].rows
        n_without = sum(row["x"] is None or row["y"] is None for row in positions)
        count = sum(len(own) for own in points.values())
        right = sum(point.true == point.predicted for own in points.values() for point in own)
        title = f"{result.label}: {number(100 * right / count)} % of {count} points are correct"
        text = (
            f"{results.title}, {results.source}. Held-out predictions by session. Squares: true "
            "class; dots: class that most recordings of the point are predicted as."
        )
        if n_without:
            text += f" {n_without} of {len(positions)} recordings have no position."
        alt = f"{title}. Sessions: {', '.join(points)}."
        draw = partial(
            surface_map_figure,
            points,
            results.task_settings.map,
            [str(name) for name in result.about["classes"]],
            title=title,
            subtitle=results.title,
            source=results.source,
        )
        yield Illustration(results.named("map", result.model), Caption(text, alt), draw, title)


def points_of(results: TaskResults, model: str) -> dict[str, list[SurfacePoint]]:
    """Return the points by session, each with its true class and its most frequent prediction.

    A point has the recordings of one class at one position of a session. Recordings without a
    position are omitted.
    """
    (result,) = [result for result in results.results if result.model == model]
    part = part_columns(GROUPED, results.dataset)._asdict()
    predicted = {
        row["recording"]: (str(row["y_true"]), str(row["y_pred"]))
        for row in result.tables[PREDICTIONS].where(**part).rows
    }
    votes: dict[tuple[str, float, float, str], Counter[str]] = defaultdict(Counter)
    for row in result.tables[POSITIONS].rows:
        if row["x"] is not None and row["y"] is not None:
            true, prediction = predicted[row["recording"]]
            votes[row["session"], row["x"], row["y"], true][prediction] += 1
    points: dict[str, list[SurfacePoint]] = defaultdict(list)
    for (session, x, y, true), counts in votes.items():
        ((prediction, _),) = counts.most_common(1)
        points[session].append(SurfacePoint(x, y, true, prediction))
    return dict(points)
