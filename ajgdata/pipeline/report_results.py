"""Documents on models' errors and costs -> what the report says of each model on each task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.models import model_label
from ajgdata.paths import Paths
from ajgdata.pipeline.evaluate import WITHHELD
from ajgdata.report.content import (
    Cost,
    ElsewhereResult,
    PartResult,
    Predictions,
    SilentResult,
    SkippedTask,
    TaskResult,
    ValueErrors,
)
from ajgdata.report.format import Score
from ajgdata.report.paper import PaperFigure
from ajgdata.store.files import read_csv, read_json
from ajgdata.types import DataError, DatasetSpec, Task


def left_out_of(run: tuple[str, str, str], document: Mapping[str, Any]) -> SkippedTask:
    """A model that could not be evaluated, and why."""
    dataset, task, model = run
    return SkippedTask(dataset, task, _label(model, document), document["skipped"])


def task_result(
    paths: Paths,
    specs: Mapping[str, DatasetSpec],
    run: tuple[str, str, str],
    document: Mapping[str, Any],
    paper: Mapping[str, PaperFigure],
) -> TaskResult:
    """What the report says of one model on one task."""
    dataset, task, model = run
    spec = specs[dataset]
    kind, scores = document["kind"], document["grouped"]
    headline = "rmse" if kind == "regression" else "accuracy"
    settings = spec.tasks[task]
    random, known = document.get("random"), settings.papers.get("known")
    period = document["period"]
    held_out = _predictions(paths.predictions(*run), kind, scores["classes"], period)
    if held_out is None:
        raise DataError(paths.predictions(*run), "holds no predictions", "delete it and run again")
    return TaskResult(
        dataset=dataset,
        dataset_title=spec.title or dataset,
        task=task,
        model=model,
        model_label=_label(model, document),
        kind=kind,
        target=document["target"],
        unit=document["unit"],
        source=document["provenance"]["source"],
        metrics=_scores(scores),
        chance=scores["chance"][headline],
        n_recordings=scores["recordings"],
        n_groups=scores["groups"],
        group_column=document["groups"],
        folds=scores["folds"],
        cost=_cost(read_json(paths.cost(*run))["grouped"]),
        predictions=held_out,
        random_split=_scores(random)[headline] if random else None,
        paper=paper[known] if known else None,
        parts=_parts(document, headline, {k: paper[v] for k, v in settings.papers.items()}),
        elsewhere=_elsewhere(document, headline, settings, paper, specs),
        level=spec.level,
        silent=tuple(
            SilentResult(dataset=name, title=specs[name].title or name, **test)
            for name, test in document["silent"].items()
        ),
        unseen=_predictions(paths.predictions(*run), kind, (), period, WITHHELD),
        period=period,
        values=tuple(ValueErrors(**one) for one in document["by_value"]),
    )


def _parts(
    document: Mapping[str, Any], headline: str, papers: Mapping[str, PaperFigure]
) -> tuple[PartResult, ...]:
    """What was evaluated beside recordings of values that were trained on."""
    made = []
    if WITHHELD in document:
        chance = document[WITHHELD]["chance"][headline]
        scores = _scores(document[WITHHELD])[headline]
        made.append(PartResult("unknown", scores, papers.get("unknown"), chance))
        scores = _scores(document["overall"])[headline]
        made.append(PartResult("overall", scores, papers.get("overall")))
    return tuple(made)


def _elsewhere(
    document: Mapping[str, Any],
    headline: str,
    task: Task,
    paper: Mapping[str, PaperFigure],
    specs: Mapping[str, DatasetSpec],
) -> tuple[ElsewhereResult, ...]:
    """The same folds' models, tested on other data sets."""
    return tuple(
        ElsewhereResult(
            part=other,
            score=_scores(document[f"on:{other}"])[headline],
            paper=paper[task.papers[other]] if other in task.papers else None,
            chance=document[f"on:{other}"]["chance"][headline],
            title=specs[other].title or other,
            level=specs[other].level,
        )
        for other in task.test_on
    )


def _label(model: str, document: Mapping[str, Any]) -> str:
    return model_label(model, document["kind"])


def _scores(scores: Mapping[str, Any]) -> dict[str, Score]:
    return {
        name: Score(
            _number(mean),
            _number(scores["sd"][name]),
            tuple(map(_number, scores["per_fold"][name])),
        )
        for name, mean in scores["mean"].items()
    }


def _number(value: float | None) -> float:
    """JSON has no NaN: null stands for it."""
    return np.nan if value is None else value


def _cost(cost: Mapping[str, Any]) -> Cost:
    return Cost(
        train_s=cost["train_s"],
        inference_ms_per_recording=1e3 * cost["latency_s"],
        peak_memory_mb=cost["peak_rss_mb"],
    )


def _predictions(
    path: Path,
    kind: str,
    classes: Sequence[str],
    period: float | None,
    split: str = "grouped",
) -> Predictions | None:
    from ajgdata.evaluate.metrics import wrapped

    rows = [row for row in read_csv(path)[1] if row["split"] == split]
    if not rows:
        return None
    dtype = np.float64 if kind == "regression" else np.str_
    y_true, y_pred = (np.asarray([r[c] for r in rows], dtype) for c in ("y_true", "y_pred"))
    fold = np.asarray([int(row["fold"]) for row in rows])
    if period:  # the repetition that is nearest to the truth: means and axes then make sense
        y_pred = y_true.astype(float) + wrapped(y_pred.astype(float) - y_true.astype(float), period)
    return Predictions(y_true, y_pred, fold, tuple(map(str, classes)))
