"""Each figure of the paper and what stands beside it: result, cost, whether they agree, why."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from ajgdata.evaluate.sorting import LONGEST_RUN
from ajgdata.report.beside_embeddings import of_embedding
from ajgdata.report.comparison import (
    HIGHER,
    LOWER,
    UNTOLD,
    YES,
    Beside,
    Reason,
    agreement,
    holds,
    together,
)
from ajgdata.report.content import Report
from ajgdata.report.experiments import PERCENTILES, spread
from ajgdata.report.format import Score, mean_sd, number, with_unit
from ajgdata.report.further import (
    About,
    ChanceTest,
    Curves,
    Energies,
    SortingResult,
    Transfers,
)
from ajgdata.report.paper import PaperFigure
from ajgdata.report.results import Cost, TaskResult
from ajgdata.report.wording import headline

#: The paper's own model, where a task has it.
PAPER_MODEL = "cnn"
#: The model whose figure the paper gives among its baselines.
BASELINE, BASELINES = "knn", "baselines"
#: Figures without a number: what is near chance, and what a model that works at home fails at.
NEAR_CHANCE, FAILS = "near chance", ("limit", "lesson")
WORKS = "no: it works"
#: Where the paper also counts the classes that are told this well.
COUNTED, WELL = "ycb", 0.9


def evidence(reason: Reason) -> str:
    """Each change with what it did: `trained at all levels (CNN 5.4 → 0.74, ridge 7 → 0.76)`."""
    changes: dict[str, list[str]] = {}
    for one in reason.tests:
        said = f"{one.model} {number(one.before)} → {number(one.after)}"
        doubt = "" if one.supported else ", within the spread of folds"
        changes.setdefault(one.change, []).append(said + doubt)
    return "; ".join(f"{change} ({', '.join(said)})" for change, said in changes.items())


def beside(report: Report) -> list[Beside]:
    """A row for each figure of the paper and each data set that the report can set beside it, in
    the paper's order."""
    rows = list(_all(report))
    order = list(dict.fromkeys(one.id for one in (*report.paper, *(row.paper for row in rows))))
    first = {(row.paper.id, row.dataset): row for row in reversed(rows)}
    return sorted(reversed(first.values()), key=lambda row: order.index(row.paper.id))


def absent(report: Report) -> list[PaperFigure]:
    """What the paper reports and this report does not."""
    found = {row.paper.id for row in _all(report)}
    return [figure for figure in report.paper if figure.id not in found]


def _all(report: Report) -> Iterator[Beside]:
    for task in report.tasks():
        yield from _of_task(report, task)
    for curves in report.curves:
        yield from _of_curves(report, curves)
    for test in report.tests:
        yield from _of_test(report, test)
    for sorting in report.sorting:
        yield from _of_sorting(report, sorting)
    for energies in report.energies:
        yield from _of_energies(report, energies)
    for transfers in report.transfers:
        yield from _of_transfers(report, transfers)
    named = {result.dataset for result in report.results if result.paper}
    for one in report.embeddings:
        if named & {one.dataset, one.settings["base"]}:  # others are of other things
            yield from of_embedding(report, one)


def _row(
    report: Report, paper: PaperFigure, result: TaskResult, score: Score, agrees: str
) -> Beside:
    return Beside(
        paper, result.dataset, result.source, headline(result, score), result.model_label,
        result.cost, agrees, _reasons(report, paper),
    )  # fmt: skip


def _reasons(report: Report, paper: PaperFigure) -> tuple[Reason, ...]:
    return tuple(reason for reason in report.reasons if paper.id in reason.of)


def _of_task(report: Report, task: tuple[TaskResult, ...]) -> Iterator[Beside]:
    """Known, unknown and overall values, and other data sets, by the paper's model."""
    first = next((r for r in task if r.model == PAPER_MODEL), task[0])
    scale = 100 if first.kind == "classification" else 1
    named = [(first.paper, first.score), *((p.paper, p.score) for p in first.parts)]
    named += [(other.paper, other.score) for other in first.elsewhere]
    for paper, score in named:
        if paper is None or paper.text == NEAR_CHANCE:  # which a test decides
            continue
        baseline = next((r for r in task if r.model == BASELINE), None)
        if paper.id == BASELINES and baseline:
            yield _baselines(report, paper, task, baseline)
            continue
        if paper.metric in FAILS:
            yield _failing(report, paper, first, score)
            continue
        scaled = Score(scale * score.mean, scale * score.sd)
        agrees = UNTOLD if paper.value is None else agreement(scaled, paper.value)
        row = _row(report, paper, first, score, agrees)
        counted = f"{row.result}; {_well_told(first)}" if paper.id == COUNTED else row.result
        yield dataclasses.replace(row, result=counted)


def _well_told(result: TaskResult) -> str:
    """`7 of 16 classes at 90 % or more`, of the recordings held out in all folds."""
    true, predicted = result.predictions.y_true, result.predictions.y_pred
    shares = [np.mean(predicted[true == one] == one) for one in np.unique(true)]
    return f"{sum(share >= WELL for share in shares)} of {len(shares)} classes at 90 % or more"


def _failing(report: Report, paper: PaperFigure, result: TaskResult, there: Score) -> Beside:
    """A model where it was trained and where it fails, and what silence says of the reason."""
    worse = result.normalise(there).mean - result.error.mean
    verdicts = {holds(Score(worse, result.error.sd), WORKS)}
    text = f"{headline(result)} where it was trained, {headline(result, there)} elsewhere"
    if result.silent:
        flagged = any(test.flagged for test in result.silent)
        verdicts.add(YES if flagged else "no: not flagged")
        text += f"; from silence {'flagged' if flagged else 'not flagged'}"
    row = _row(report, paper, result, there, together(verdicts))
    return dataclasses.replace(row, result=text)


def _baselines(
    report: Report, paper: PaperFigure, task: tuple[TaskResult, ...], baseline: TaskResult
) -> Beside:
    """k-NN beside the paper's, and which model is best of all."""
    score = Score(100 * baseline.score.mean, 100 * baseline.score.sd)
    best = min(task, key=lambda r: r.error.mean)
    agrees = agreement(score, paper.value or 0.0)
    row = _row(report, paper, baseline, baseline.score, agrees)
    text = f"{row.result}; best of {len(task)}: {best.model_label}, {headline(best)}"
    return dataclasses.replace(row, result=text)


def _of_curves(report: Report, curves: Curves) -> Iterator[Beside]:
    """How many groups reach the accuracy that the paper names."""
    paper, line = curves.paper, curves.lines[0]
    if paper is None or paper.value is None or paper.reached is None:
        return
    enough = np.flatnonzero(line.mean >= paper.reached)
    most = f"{mean_sd(Score(line.mean[-1], line.sd[-1]), curves.unit)} with {line.groups[-1]}"
    if len(enough):
        needed = int(line.groups[enough[0]])
        text, agrees = f"{needed} ({most})", YES if needed >= paper.value else LOWER
    else:  # more than any that was tried
        text = f"more than {line.groups[-1]} ({most})"
        agrees = YES if line.groups[-1] >= paper.value else UNTOLD
    cost = _cost(report, curves.about)
    yield Beside(
        paper, curves.about.dataset, curves.about.source, text, line.model_label, cost, agrees,
        _reasons(report, paper),
    )  # fmt: skip


def _paper_model(report: Report, about: About) -> TaskResult | None:
    """The paper's model on a task, or else on another of its data set."""
    there = [r for r in report.results if (r.dataset, r.model) == (about.dataset, PAPER_MODEL)]
    return min(there, key=lambda r: r.task != about.task, default=None)


def _cost(report: Report, about: About) -> Cost | None:
    """What training that on the whole data set costs."""
    model = _paper_model(report, about)
    return model.cost if model else None


def _of_test(report: Report, test: ChanceTest) -> Iterator[Beside]:
    """A figure that the paper calls near chance: it agrees if ours cannot be told from it."""
    model = _paper_model(report, test.about)
    if model is None or model.paper is None or model.paper.text != NEAR_CHANCE:
        return
    agrees = HIGHER if test.differs else YES
    row = _row(report, model.paper, model, model.score, agrees)
    told = f"{row.result}; {test.model_label} against chance: p = {number(test.p, 2)}"
    yield dataclasses.replace(row, result=told)


def _of_sorting(report: Report, sorting: SortingResult) -> Iterator[Beside]:
    """Sorts in a row: the paper's run lies among ours, or beyond 90 % of them. Ours are those with
    probabilities as they are: the paper says nothing of scaling them."""
    if sorting.paper is None or sorting.paper.value is None:
        return
    sorts = sorting.parts[0].sorts
    low, _, high = np.percentile(sorts, PERCENTILES)
    value = sorting.paper.value
    agrees = LOWER if high < value else HIGHER if low > value else YES
    cost = _cost(report, sorting.about)
    result = with_unit(spread(sorts), sorting.paper.unit)
    if max(sorts) >= LONGEST_RUN:
        result += f"; runs end at {number(LONGEST_RUN, 4)}"
    yield Beside(
        sorting.paper, sorting.about.dataset, sorting.about.source, result,
        sorting.model_label, cost, agrees, _reasons(report, sorting.paper),
    )  # fmt: skip


def _of_energies(report: Report, energies: Energies) -> Iterator[Beside]:
    """What the class that loses most loses against the reference."""
    paper = energies.paper
    if paper is None or paper.value is None:
        return
    lost = [p for p in energies.parts if p.label != energies.reference]
    least = min(lost, key=lambda part: part.mean)
    score = Score(100 * (1 - least.mean), 100 * least.sd)
    listed = ", ".join(
        f"{p.label} {number(100 * (1 - p.mean))} %" for p in sorted(lost, key=lambda p: p.mean)
    )
    agrees = agreement(score, paper.value, at_least=True)
    yield Beside(
        paper, energies.about.dataset, energies.about.source, f"lost: {listed}", "", None, agrees,
        _reasons(report, paper),
    )  # fmt: skip


def _of_transfers(report: Report, transfers: Transfers) -> Iterator[Beside]:
    """The paper's model where it was trained, and on each other gripper without calibration."""
    paper, model = transfers.paper, _paper_model(report, transfers.about)
    lines = [t for t in transfers.lines if not model or t.model_label == model.model_label]
    if paper is None or not lines:
        return
    sign = 1 if transfers.metric == "accuracy" else -1
    verdicts = {
        holds(Score(sign * (line.home[0] - line.mean[0]), line.home[1]), WORKS) for line in lines
    }
    told = [
        f"{mean_sd(Score(line.mean[0], line.sd[0]), transfers.unit)} on {line.title}"
        for line in lines
    ]
    home = mean_sd(Score(*lines[0].home), transfers.unit)
    yield Beside(
        paper, transfers.about.dataset, transfers.about.source,
        f"{home} where it was trained, {', '.join(told)}", lines[0].model_label,
        _cost(report, transfers.about), together(verdicts), _reasons(report, paper),
    )  # fmt: skip
