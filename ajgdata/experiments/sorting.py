"""Sorting by sound with held-out recordings, in random order until the first refusal."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from ajgdata.evaluate.agreement import (
    ACCEPTED,
    GRASP_INTERVAL,
    Estimate,
    Interval,
    compare_with_published,
)
from ajgdata.evaluate.calibration import calibration_error, reliability
from ajgdata.evaluate.in_use import calibrated_probabilities
from ajgdata.evaluate.intervals import clopper_pearson, exact_lower_bound
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.evaluate.sorting import (
    DecisionShares,
    decision_shares,
    decisions,
    drawn_rows,
    sorting_run,
)
from ajgdata.experiments.base import Experiment, Inputs, Lookup, Outcome, Result, TaskResults
from ajgdata.experiments.built_in import BUILT_IN
from ajgdata.experiments.plots import PERCENTILES, Plot
from ajgdata.experiments.scores import ScoreKey, ScoreRow, score_table
from ajgdata.experiments.settings import SortingSettings
from ajgdata.report.comparison import Mark, PaperComparison, PaperFigure
from ajgdata.report.format import number
from ajgdata.report.report_data import ResultRow
from ajgdata.types.table import table_of

Row = dict[str, Any]
#: Number of simulated runs of sorting, each with its own seed.
RUNS = 500
#: Probabilities of the model.
PLAIN = "plain"
#: Probabilities that are scaled by a temperature, as in a final model.
CALIBRATED = "calibrated"
#: Results of a run: the column, its metric, and its title.
RUN_METRICS = {
    "sorts": ("sorted_until_refusal", "Objects sorted until the first refusal"),
    "errors": ("errors_until_refusal", "Objects in a wrong bin"),
}


@dataclasses.dataclass(frozen=True)
class DecisionShare:
    """A share of decisions that the paper also has.

    `part` names the published value in `paper` of a task. The columns `key`, `key low` and
    `key high` of the table `decisions` have the share and the ends of its interval. `title` is for
    people. `chance` is the share of a model without information, given the number of classes.
    """

    part: str
    key: str
    title: str
    chance: float | None = None

    def chance_level(self, classes: int) -> float:
        """Return the share of a model without information on `classes` equally frequent classes."""
        return 1 / classes if self.chance is None else self.chance


#: A model without information refuses all objects; if it must choose, it is correct by chance.
QUANTITIES = (
    DecisionShare("sorting", "accepted", "accepted among presented", chance=0.0),
    DecisionShare("sorting.correct", "correct", "correct among accepted"),
)


def measure(inputs: Inputs, settings: SortingSettings, model: str) -> Outcome:
    """Return the calibration of `model`, its decisions, and runs of sorting the task's objects."""
    data = inputs.data()
    result = calibrated_probabilities(
        data.feature,
        data.value,
        data.group,
        model=model,
        folds=inputs.task_settings.folds,
        seed=inputs.seed,
    )
    label = np.searchsorted(result.classes, data.value)
    scores: list[ScoreRow] = []
    bins: list[Row] = []
    decided: list[Row] = []
    runs: list[Row] = []
    for name, probability in ((PLAIN, result.plain), (CALIBRATED, result.scaled)):
        key = ScoreKey(model, *part_columns(GROUPED, inputs.dataset), condition=name)
        reliable = reliability(probability.max(axis=1), probability.argmax(axis=1) == label)
        bins += [{"part": name, **dataclasses.asdict(interval)} for interval in reliable]
        scores.append(ScoreRow("calibration_error", "pooled", calibration_error(reliable), key))
        chosen = decisions(probability, settings.threshold)
        shares = decision_shares(probability, chosen, label, data.group)
        decided.append({"part": name, "classes": len(result.classes), **_cells(shares)})
        scores += _share_scores(key, shares)
        for run in range(RUNS):
            sorted_objects = sorting_run(chosen, label, drawn_rows(label, inputs.seed + run))
            runs.append({"part": name, "run": run, **vars(sorted_objects)})
            for column, (metric, _) in RUN_METRICS.items():
                value = getattr(sorted_objects, column)
                scores.append(ScoreRow(metric, f"run {run}", value, key))
    bin_columns = {
        **{key: key for key in bins[0]},
        "confidence": "Probability",
        "accuracy": "Correct",
        "part": "Probabilities",
    }
    decision_columns = {
        **{key: key.capitalize() for key in decided[0]},
        "part": "Probabilities",
    }
    run_columns = {
        "part": "Probabilities",
        "run": "Run",
        **{key: title for key, (_, title) in RUN_METRICS.items()},
    }
    return Outcome(
        (
            score_table(scores, "Sorting"),
            table_of("reliability", "Reliability", bins, **bin_columns),
            table_of("decisions", "Decisions", decided, **decision_columns),
            table_of("runs", "Simulated runs", runs, **run_columns),
        )
    )


def _cells(shares: DecisionShares) -> Row:
    """Return the shares of decisions as cells of the table `decisions`."""
    row: Row = {"grasps": shares.grasps, "accuracy": shares.accuracy}
    for quantity in QUANTITIES:
        share = getattr(shares, quantity.key)
        row[quantity.key] = share.value
        row[f"{quantity.key} low"] = share.interval.low
        row[f"{quantity.key} high"] = share.interval.high
    return row


def _share_scores(key: ScoreKey, shares: DecisionShares) -> Iterator[ScoreRow]:
    """Yield the accuracy of all decisions, and both shares with their intervals."""
    accepted = key._replace(condition=f"{key.condition}, {ACCEPTED}")
    yield ScoreRow("accuracy", "pooled", shares.accuracy, key)
    for metric, share in (("share", shares.accepted), ("accuracy", shares.correct)):
        yield ScoreRow(metric, "pooled", share.value, accepted)
        for statistic, end in zip(GRASP_INTERVAL, share.interval, strict=True):
            yield ScoreRow(metric, statistic, end, accepted)


def _decision_row(result: Result, part: str) -> Row:
    """Return the row of the table `decisions` for the probabilities `part`; missing is NaN."""
    (row,) = result.tables["decisions"].where(part=part).rows
    return {key: np.nan if cell is None else cell for key, cell in row.items()}


def _interval_of(quantity: DecisionShare, row: Row) -> Interval:
    """Return the interval of a share of decisions."""
    return Interval(row[f"{quantity.key} low"], row[f"{quantity.key} high"])


def _share_text(quantity: DecisionShare, row: Row) -> str:
    """Return a share of decisions with its interval: `85 % (76 to 92)`."""
    value = row[quantity.key]
    if np.isnan(value):
        return "nothing"
    text = f"{number(100 * value)} %"
    interval = _interval_of(quantity, row)
    if not interval.is_defined:
        return text
    return f"{text} ({number(100 * interval.low)} to {number(100 * interval.high)})"


def paper_comparison(results: TaskResults, _: Lookup) -> Iterator[PaperComparison]:
    """Yield both shares of each model with calibrated probabilities; plain ones are in the text."""
    for result in results.results:
        for quantity in QUANTITIES:
            paper = results.papers.get(quantity.part)
            if paper is not None and paper.trials is not None:
                yield _compared(results, result, quantity, paper)


def _compared(
    results: TaskResults, result: Result, quantity: DecisionShare, paper: PaperFigure
) -> PaperComparison:
    """Return a share next to the published count; the verdict uses the intervals of both."""
    if paper.correct is None or paper.trials is None:
        raise ValueError(f"{paper.id}: requires correct and trials")
    row = _decision_row(result, CALIBRATED)
    value = row[quantity.key]
    interval = _interval_of(quantity, row)
    chance = quantity.chance_level(row["classes"])
    verdict = compare_with_published(
        Estimate(value, interval, chance, perfect=1.0),
        paper.correct / paper.trials,
        clopper_pearson(paper.correct, paper.trials),
    )
    bound = exact_lower_bound(paper.correct, paper.trials)
    texts = [
        f"{_share_text(quantity, row)} {quantity.title} ({row['grasps']} grasps, calibrated)",
        f"{_share_text(quantity, _decision_row(result, PLAIN))} with plain probabilities",
    ]
    for scenario, other in _other_scenarios(results, result.model):
        texts.append(f"{_share_text(quantity, other)} for {scenario}")
    texts.append(
        f"{paper.correct} of {paper.trials} in the paper, at least {number(100 * bound)} % "
        "(one-sided 95 % bound)"
    )
    ours = Mark("ours", 100 * value, 100 * interval.low, 100 * interval.high)
    guess = Mark("chance", *[100 * chance] * 3)
    label = ", ".join(filter(None, (paper.row, results.settings.scenario)))
    return results.compared(
        paper, "; ".join(texts), result.label, verdict, marks=(ours, guess), label=label
    )


def _other_scenarios(results: TaskResults, model: str) -> Iterator[tuple[str, Row]]:
    """Yield the scenarios of other tasks on the page, with the calibrated decisions of `model`."""
    for task in results.same_page:
        if (task.dataset, task.task) == (results.dataset, results.task):
            continue
        for result in task.results:
            if result.model == model:
                yield task.settings.scenario or task.title, _decision_row(result, CALIBRATED)


def rows(results: TaskResults) -> Iterator[ResultRow]:
    """Yield both shares of each model, with calibrated and with plain probabilities."""
    for result in results.results:
        for part in (CALIBRATED, PLAIN):
            row = _decision_row(result, part)
            for quantity in QUANTITIES:
                yield ResultRow(
                    label=result.label,
                    metric=f"{quantity.title}, {part} probabilities",
                    value=_share_text(quantity, row),
                    chance=f"{number(100 * quantity.chance_level(row['classes']))} %",
                    paper=results.papers.get(quantity.part),
                )


def finding(results: TaskResults) -> str:
    """Return both shares, and the runs, of the first model with calibrated probabilities."""
    first = results.results[0]
    row = _decision_row(first, CALIBRATED)
    runs = first.tables["runs"].where(part=CALIBRATED).numbers("sorts")
    low, middle, high = map(number, np.percentile(runs, PERCENTILES))
    accepted, correct = (number(100 * row[quantity.key]) for quantity in QUANTITIES)
    return (
        f"{first.label}: {accepted} % accepted, {correct} % of the accepted correct; "
        f"{middle} ({low} to {high}) objects until the first refusal"
    )


LENGTHS_PLOT = Plot(
    "histogram",
    "runs",
    "objects sorted until the first refusal, in simulated runs on held-out grasps in random order; "
    "a run ends when no class is probable enough, or after 1000 objects; an error does not end it",
    value="sorts",
    x="run",
    series=("model", "part"),
    over="runs",
    published="count",
    title=finding,
)
RELIABILITY_PLOT = Plot(
    "lines",
    "reliability",
    "share of correct predictions against their probability, as the model gives it (plain) and "
    "scaled by a temperature from other grasps (calibrated)",
    value="accuracy",
    x="confidence",
    series=("model", "part"),
    over="bins",
    percent=("accuracy", "confidence"),
    ideal=True,
    name="reliability",
)
EXPERIMENT = Experiment(
    BUILT_IN["sorting"],
    measure=measure,
    plots=(LENGTHS_PLOT, RELIABILITY_PLOT),
    own_rows=rows,
    paper_comparison=paper_comparison,
)
