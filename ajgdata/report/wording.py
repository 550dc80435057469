"""Every number, caption and alternative text of the report, in one place."""

from __future__ import annotations

from collections import Counter

from ajgdata.report.content import DatasetSummary, ElsewhereResult, PartResult, Report, TaskResult
from ajgdata.report.format import Caption, Score, mean_sd, number, with_unit, words


def headline(result: TaskResult, score: Score | None = None) -> str:
    """The headline metric (or `score`, in the same terms) with its unit."""
    score = result.score if score is None else score
    if result.kind == "classification":
        return mean_sd(score, "%", 100)
    return mean_sd(score, result.unit)


def metric_name(result: TaskResult) -> str:
    """`RMSE` or `accuracy`, as a reader says it."""
    return "RMSE" if result.kind == "regression" else "accuracy"


def chance(result: TaskResult) -> str:
    """The headline metric of a predictor that ignores the sound."""
    return headline(result, Score(result.chance, 0.0))


def part_label(part: PartResult) -> str:
    """What a further part of a task is."""
    if isinstance(part, ElsewhereResult):
        return f"tested on {part.title}"
    return {
        "unknown": "values withheld from training",
        "overall": "known and withheld values together",
    }[part.part]


def part_chance(result: TaskResult, part: PartResult) -> str:
    """The same on a further part of the task."""
    return headline(result, Score(part.chance, 0.0))


def quantity(result: TaskResult) -> str:
    """The target without the unit in its name, which is shown beside it: `edge_mm` -> `edge`."""
    suffix = "deg" if result.unit == "°" else result.unit
    return words(result.target.removesuffix(f"_{suffix}"))


def task_name(result: TaskResult) -> str:
    """Data set and task, as shown in legends and headings."""
    return f"{result.dataset_title} · {words(result.task)}"


def prediction_caption(result: TaskResult) -> Caption:
    """Caption of `figures.prediction_figure`."""
    head = (
        f"{result.model_label} on {result.dataset_title}, {result.source}: "
        f"{metric_name(result)} {headline(result)} (chance {chance(result)}), "
        f"{result.folds} folds, no {words(result.group_column)} on both sides of a split."
    )
    count = f"{len(result.predictions.y_true):,} held-out predictions"
    if result.kind == "regression":
        unseen = "" if result.unseen is None else " Orange: values withheld from all training."
        if result.period is not None:
            unseen += (
                f" The target repeats after {with_unit(number(result.period), result.unit)}: each "
                "prediction is drawn at its repetition nearest to the truth."
            )
        return Caption(
            f"{head} Small dots: {count}; large dots: mean ± one standard deviation per true "
            "value (or per bin, where there are more than 30 values); dashed: perfect; dotted: "
            f"always predicting the mean.{unseen}",
            f"Predicted against true {quantity(result)} with the identity line. {head}",
        )
    return Caption(
        f"{head} Rows are true classes and sum to one: colour is the share of a row, numbers "
        f"count the {count}. The mark on the colour scale is chance.",
        f"Confusion matrix, {len(result.predictions.classes)} classes. {head} {_mistakes(result)}",
    )


def _mistakes(result: TaskResult) -> str:
    """The most frequent confusion, in words."""
    p = result.predictions
    pairs = zip(map(str, p.y_true), map(str, p.y_pred), strict=True)
    confusions = Counter(sorted((true, taken) for true, taken in pairs if true != taken))
    if not confusions:
        return "There are no confusions."
    ((true, taken), count) = confusions.most_common(1)[0]
    return f"Most frequent confusion: {true} taken for {taken}, {count} times."


def spectra_caption(dataset: DatasetSummary) -> Caption:
    """Caption of `figures.spectra_figure`."""
    grouping = words(dataset.spectra.grouping) if dataset.spectra else "class"
    names = ", ".join(dataset.spectra.labels) if dataset.spectra else ""
    return Caption(
        f"What the models see of {dataset.title} ({dataset.source}). Top: mean over the rows "
        "below (each counts the same), in dB against its highest value, with the range of the "
        f"rows. Bottom: how the mean of each {grouping} differs from it.",
        f"Mean spectrum, and its deviation in dB, for each {grouping}: {names}.",
    )


def cost_caption(report: Report) -> Caption:
    """Caption of `figures.cost_figure`."""
    best = [min(models, key=lambda r: r.error.mean) for models in report.tasks()]
    listed = "; ".join(
        f"{task_name(r)}: {r.model_label}, {number(r.error.mean, 2)} of chance error "
        f"in {number(r.cost.train_s)} s"
        for r in best
    )
    return Caption(
        "Error against run time. The error is RMSE / chance RMSE or (1 − accuracy) / "
        "(1 − chance accuracy), so that tasks share one axis: 0 is perfect, 1 is chance. Filled "
        "markers joined by a line form the Pareto front of a task, its models which no other beats "
        "in both error and time; hollow ones are beaten. The area of a marker is peak memory. "
        "Times belong to the machine that made this page.",
        f"Normalised error against training and inference time. Lowest errors: {listed}.",
    )


def tradeoff_caption(task: tuple[TaskResult, ...]) -> Caption:
    """Caption of `comparisons.tradeoff_figure`."""
    first = task[0]
    listed = "; ".join(
        f"{r.model_label}: {headline(r)}, training {number(r.cost.train_s)} s, "
        f"inference {number(r.cost.inference_ms_per_recording)} ms"
        for r in task
    )
    return Caption(
        f"{metric_name(first)} of {len(task)} models on the same folds, with the same settings as "
        "on every other task. Bars: one standard deviation over folds. Filled markers joined by a "
        "line form the Pareto front: no other model beats them in both error and time. Times "
        "belong to the machine that made this page.",
        f"{metric_name(first)} against training and inference time. {listed}.",
    )


def level_caption(task: tuple[TaskResult, ...]) -> Caption:
    """Caption of `comparisons.level_figure`."""
    first = task[0]
    listed = "; ".join(
        f"{r.model_label}: "
        + ", ".join(
            f"{headline(r, score)} at {with_unit(number(level.value), level.unit)}"
            for level, score in r.levels()
        )
        for r in task
    )
    return Caption(
        f"The models of {task_name(first)}, trained there only and tested on the same task at "
        "other levels: mean ± one standard deviation over folds. Of a grasp that was recorded at "
        "several levels, no fold trains on one recording and tests on another.",
        f"{metric_name(first)} against level. {listed}.",
    )


def split_caption(report: Report) -> Caption:
    """Caption of `figures.split_figure`."""
    listed = "; ".join(
        f"{task_name(r)}, {r.model_label}: {headline(r)} grouped, "
        f"{headline(r, r.random_split)} random"
        for r in report.compared()
    )
    hidden = [
        (r, 1 - r.normalise(r.random_split).mean / r.error.mean)
        for r in report.compared()
        if r.random_split and r.error.mean > 0
    ]
    gained = [f"{task_name(r)}, {r.model_label}: {share:.0%}" for r, share in hidden]
    return Caption(
        "The same models and recordings under two splits. Grouped: no group on both sides (used "
        "everywhere else on this page). Random: groups ignored. Error as a share of chance, mean ± "
        "one standard deviation over folds. Error that the random split hides: "
        f"{'; '.join(gained)}.",
        f"Normalised error of grouped and random splits. {listed}.",
    )
