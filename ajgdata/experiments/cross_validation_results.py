"""Results of cross-validation: figures, rows of the table of results, comparison with the paper."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from sklearn.metrics import confusion_matrix

from ajgdata.evaluate.agreement import (
    GRASP_INTERVAL,
    NO_BETTER,
    Estimate,
    Interval,
    placebo_test,
)
from ajgdata.evaluate.calibration import accuracy_of_most_confident
from ajgdata.evaluate.design import Design
from ajgdata.evaluate.metrics import wrapped
from ajgdata.evaluate.mirror import MirrorErrors, mirror_errors
from ajgdata.evaluate.parts import (
    GROUPED,
    IN_SESSIONS,
    OVERALL,
    RANDOM,
    SESSION_SPLIT,
    SESSIONS,
    SESSIONS_OVERALL,
    SESSIONS_WITHHELD,
    WITHHELD,
    elsewhere,
    part_columns,
    placebo,
)
from ajgdata.experiments.base import Result, TaskResults
from ajgdata.experiments.plots import Plot, binned
from ajgdata.experiments.scores import PREDICTIONS, SCORES, axis_column, is_fold
from ajgdata.report.comparison import (
    Mark,
    PaperFigure,
    ResultCost,
    mark_of,
)
from ajgdata.report.format import Score, column_title, mean_sd, number, sentence, words
from ajgdata.report.report_data import ResultRow
from ajgdata.types.registry import COVARIATES_ALONE, PAPER_MODEL
from ajgdata.types.table import Table, table_of

#: Parts of a task: key in dataset.yaml under `paper`, and heading in the table of results.
TASK_PARTS = {
    GROUPED: ("known", ""),
    RANDOM: ("known_by_recording", "split by recording: grasps are in training and test data"),
    WITHHELD: ("unknown", "values withheld from training"),
    OVERALL: ("overall", "known and withheld values together"),
}
#: The same with sessions held out: what is evaluated, and heading in the table of results.
SESSION_PARTS = {
    SESSIONS: ("held-out sessions", "held-out sessions"),
    SESSIONS_WITHHELD: ("held-out sessions, withheld", "values withheld, held-out sessions"),
    SESSIONS_OVERALL: ("held-out sessions, overall", "all values, held-out sessions"),
}
#: Splits of the placebo, and what is evaluated.
PLACEBO_SPLITS = {
    GROUPED: "placebo",
    RANDOM: "placebo, random split",
    SESSION_SPLIT: "placebo, held-out sessions",
}
#: Split of the placebo that is compared with a part.
SPLIT_OF_PART = {GROUPED: GROUPED, RANDOM: RANDOM, SESSIONS: SESSION_SPLIT}
#: Heading of the placebo in the table of results.
PLACEBO_HEADING = "placebo: one object under several names"
#: Share from which two classes count as confused, and the number of pairs that are listed.
CONFUSED = 0.1
MAX_CONFUSED = 3
#: Shares of predictions that are kept, in the figure of confident predictions.
SHARES_KEPT = tuple(share / 20 for share in range(1, 21))
#: Fewest predictions whose accuracy a title states.
MIN_CONFIDENT = 20
SHORTEST_S = 1e-3  #: shorter times are drawn as this on a logarithmic axis


@dataclass(frozen=True, eq=False)
class ModelResult:
    """Results of one model on one task; scores are in the unit of the table, not as shown."""

    task: TaskResults
    result: Result

    @property
    def label(self) -> str:
        """Return the model's name for people."""
        return self.result.label

    @property
    def classes(self) -> list[str]:
        """Return the classes of a classification in the order of the model."""
        return [str(name) for name in self.result.about["classes"]]

    def _columns(self, part: str) -> Mapping[str, str]:
        """Return the cells that identify a part in tables, by column."""
        return part_columns(part, self.task.dataset)._asdict()

    @cached_property
    def _values(self) -> Mapping[str, Mapping[str, float]]:
        """Return values of the metric that is read first, by part and statistic; missing: NaN."""
        parts = [*TASK_PARTS, *SESSION_PARTS, *map(self.placebo_part, PLACEBO_SPLITS)]
        parts += [elsewhere(name) for name in self.task.settings.test_on]
        scores = self.result.tables[SCORES].where(metric=self.task.metric, condition="")
        tables = {part: scores.where(**self._columns(part)) for part in parts}
        return {
            part: dict(zip(table.column("statistic"), table.numbers("value").tolist(), strict=True))
            for part, table in tables.items()
            if table.rows
        }

    def has(self, part: str) -> bool:
        """Return whether a part was evaluated."""
        return part in self._values

    def folds(self, part: str = GROUPED) -> list[float]:
        """Return the first metric of the task for each fold of a part."""
        return [v for name, v in self._values[part].items() if is_fold(name)]

    def score(self, part: str = GROUPED) -> Score:
        """Return mean and deviation over folds of the metric that is read first."""
        return Score(self._values[part]["mean"], self._values[part]["sd"])

    def interval(self, part: str = GROUPED) -> Interval:
        """Return the 95 % interval over grasps of the metric that is read first."""
        return Interval(*(self._values[part].get(end, math.nan) for end in GRASP_INTERVAL))

    def with_interval(self, part: str = GROUPED) -> Score:
        """Return the metric that is read first with its interval over grasps, if it is known."""
        return Score(*self.score(part)[:2], (), *self.interval(part))

    def chance(self, part: str = GROUPED) -> float:
        """Return the metric of a guess that ignores the sound; NaN if it is unknown."""
        return self._values[part].get("chance", math.nan)

    def placebo_part(self, split: str) -> str:
        """Return the part of the placebo with a split, a key of PLACEBO_SPLITS."""
        return placebo(self.task.settings.placebo or self.task.dataset, split)

    def estimate(self, part: str = GROUPED) -> Estimate:
        """Return the first metric of the task with its interval, chance and perfect value."""
        score = self.score(part).mean
        return Estimate(score, self.interval(part), self.chance(part), self.perfect)

    def placebo(self, part: str = GROUPED) -> Score | None:
        """Return the metric of the placebo by the split of a part; None if it was not recorded.

        Withheld values and other data sets have no placebo. The names of a placebo can be fewer
        than the classes of the task, so the metric is converted to the chance level of the part.
        """
        own = self._placebo_of(part)
        if own is None:
            return None
        estimate = self.estimate(own)
        chance = self.chance(part)
        value, interval, _, _ = estimate.at_chance(chance)
        sd = estimate.skill_factor(chance) * self.score(own).sd
        return Score(value, sd, (), *interval)

    def _placebo_of(self, part: str) -> str | None:
        """Return the part of the placebo that is compared with a part; None without a placebo."""
        split = SPLIT_OF_PART.get(part)
        if split is None or not self.has(self.placebo_part(split)):
            return None
        return self.placebo_part(split)

    def in_sessions(self, part: str = GROUPED) -> Score | None:
        """Return the metric of a part with held-out sessions and its interval, if evaluated."""
        own = IN_SESSIONS.get(part, "")
        return self.with_interval(own) if self.has(own) else None

    @property
    def perfect(self) -> float:
        """Return the best possible value of the first metric of the task."""
        return 0.0 if self.task.task_settings.kind == "regression" else 1.0

    def error(self, part: str = GROUPED) -> float:
        """Return the distance of the metric from its best value: RMSE, or 1 - accuracy."""
        return abs(self.score(part).mean - self.perfect)

    def beats_chance(self, part: str = GROUPED) -> bool:
        """Return whether the metric is better than chance, and than the placebo.

        The interval over grasps is on the better side of chance; that of the difference to the
        placebo is on the better side of 0.
        """
        own = self._placebo_of(part)
        if own is None:
            return self.estimate(part).is_better_than_chance
        return placebo_test(self.estimate(part), self.estimate(own)).is_better

    @cached_property
    def measured(self) -> Mapping[str, float]:
        """Return the cost on the grouped split, by the name of what was measured."""
        rows = self.result.cost[SCORES].where(split=GROUPED, test_set="").rows
        return {str(row["metric"]): float(row["value"] or 0) for row in rows}

    @property
    def cost(self) -> ResultCost:
        """Return the cost of the model on the grouped split."""
        return ResultCost(self.measured["train_cpu_s"], 1e3 * self.measured["latency_s"])

    def axis_score(self, axis: str) -> Score:
        """Return mean and deviation over folds of the RMSE of one axis of a vector."""
        scores = self.result.tables[SCORES].where(
            metric=self.task.metric, condition=axis, **self._columns(GROUPED)
        )
        value = {row["statistic"]: row["value"] for row in scores.rows}
        return Score(value["mean"], value["sd"])

    def predictions(self, part: str = GROUPED, axis: str = "") -> tuple[np.ndarray, np.ndarray]:
        """Return true and predicted values (n,) of a part: numbers, or labels of classes.

        `axis` is that of a vector, and "" for one column. Predictions of a target with a period are
        given at the repetition nearest to the truth.
        """
        table = self.result.tables[PREDICTIONS].where(**self._columns(part))
        true = np.array(table.column(axis_column("y_true", axis)))
        predicted = np.array(table.column(axis_column("y_pred", axis)))
        if self.task.task_settings.period_deg:
            predicted = true + wrapped(predicted - true, self.task.task_settings.period_deg)
        return true, predicted

    def confidence(self, part: str = GROUPED) -> np.ndarray:
        """Return the probability (n,) of each predicted class of a part; NaN if it is unknown."""
        table = self.result.tables[PREDICTIONS].where(**self._columns(part))
        return table.numbers("probability")

    def recordings(self, part: str = GROUPED) -> list[str]:
        """Return the recordings `session/recording` of the predictions of a part: n names."""
        table = self.result.tables[PREDICTIONS].where(**self._columns(part))
        return list(table.column("recording"))

    def mirror_inputs(self, part: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return true angles, predicted angles and folds (n,) of a part."""
        table = self.result.tables[PREDICTIONS].where(**self._columns(part))
        return table.numbers("y_true"), table.numbers("y_pred"), table.numbers("fold")

    def mirror_errors(self, part: str) -> MirrorErrors | None:
        """Return errors to the nearer of angle and mirror image; None without a mirror plane."""
        if self.task.mirror_deg is None:
            return None
        inputs = self.mirror_inputs(part)
        return mirror_errors(*inputs, self.task.mirror_deg, self.task.task_settings.period_deg)

    @property
    def parts(self) -> list[tuple[str, PaperFigure | None]]:
        """Return the parts that were tested, the grouped split first, with the paper's rows."""
        papers = self.task.papers
        parts = [(part, papers.get(key)) for part, (key, _) in TASK_PARTS.items()]
        parts += [(elsewhere(name), papers.get(name)) for name in self.task.settings.test_on]
        return [(part, paper) for part, paper in parts if self.has(part)]

    def shown(self, score: Score, part: str = "") -> str:
        """Return a score with its unit; of a `part` with a note if it is not better than chance."""
        text = mean_sd(score, self.task.shown_unit, self.task.scale)
        return text if not part or self.beats_chance(part) else f"{text}, {NO_BETTER}"


def models_of(results: TaskResults) -> list[ModelResult]:
    """Return the models of a task in the order in which the task names them."""
    return [ModelResult(results, result) for result in results.results]


def best_of(models: Sequence[ModelResult]) -> ModelResult:
    """Return the model of lowest error; of equals, the first.

    The model of covariates alone is a control without the sound, so it counts only if there is no
    other model.
    """
    with_sound = [model for model in models if model.result.model != COVARIATES_ALONE]
    return min(with_sound or models, key=ModelResult.error)


def training_cost(results: TaskResults, label: str) -> ResultCost | None:
    """Return the cost of the model with a label, if the task has it."""
    return next((model.cost for model in models_of(results) if model.label == label), None)


# Figures


def shown_model(results: TaskResults) -> ModelResult:
    """Return the model that a task is about: the paper's if the task is compared, else the best."""
    models = models_of(results)
    own = [model for model in models if model.result.model == PAPER_MODEL and results.papers]
    return own[0] if own else best_of(models)


def finding(results: TaskResults) -> str:
    """Return the score of the model that a task is about, with chance."""
    model = shown_model(results)
    chance = model.shown(Score(model.chance(), 0.0))
    score = model.shown(model.score(), GROUPED)
    return f"{model.label}: {results.metric_title} {score} (chance {chance})"


def class_shares(results: TaskResults) -> Table:
    """Return the share of each predicted class in the recordings of each true class."""
    rows = []
    if results.task_settings.kind == "classification":
        model = shown_model(results)
        classes = model.classes
        shares = confusion_matrix(*model.predictions(), labels=classes, normalize="true")
        rows = [
            {"true": true, "predicted": predicted, "share": shares[i, j]}
            for i, true in enumerate(classes)
            for j, predicted in enumerate(classes)
        ]
    columns = {"true": "True class", "predicted": "Predicted class", "share": "Share"}
    return table_of("shares", "Predictions", rows, **columns)


def numbers(results: TaskResults) -> Table:
    """Return true and predicted values of each model; `mean` is that of the known true values.

    Each axis of a vector is a panel of its own.
    """
    parts = {"known values": GROUPED, "withheld values": WITHHELD}
    rows = []
    is_number = results.task_settings.kind == "regression"
    panels = product(models_of(results), results.task_settings.axes or ("",))
    for model, axis in panels if is_number else ():
        mean = float(model.predictions(axis=axis)[0].mean())
        label = f"{model.label}, {axis}" if axis else model.label
        for values, part in parts.items():
            if model.has(part):
                true, predicted = model.predictions(part, axis)
                row = {"model": label, "values": values, "mean": mean}
                pairs = zip(binned(true), predicted, strict=True)
                rows += [{**row, "true": t, "predicted": p} for t, p in pairs]
    name = column_title(results.target_title, results.task_settings.unit)
    columns = {"model": "Model", "values": "Values", "true": f"True {name}"}
    return table_of(
        "values", "Predictions", rows, **columns, predicted=f"Predicted {name}", mean=""
    )


def run_times(results: TaskResults) -> Table:
    """Return error and training time of each model and fold; none of a single model."""
    models = models_of(results) if len(results.results) > 1 else []
    rows = [
        {
            "model": model.label,
            "train_cpu_s": max(model.cost.train_cpu_s, SHORTEST_S),
            "error": results.scale * abs(value - model.perfect),
            "chance": results.scale * abs(model.chance() - model.perfect),
        }
        for model in models
        for value in model.folds()
    ]
    columns = {
        "model": "Model",
        "train_cpu_s": "CPU time to train all folds, s",
        "chance": "Chance",
    }
    error = column_title("Error", results.shown_unit)
    return table_of("run times", "Error and run time", rows, **columns, error=error)


def confidence_table(results: TaskResults) -> Table:
    """Return the accuracy of the most confident predictions by their share, for each model.

    There are no rows unless the task requests them. A model without probabilities has none.
    """
    rows = []
    parts = [GROUPED, *(elsewhere(name) for name in results.settings.test_on)]
    for model in models_of(results) if results.task_settings.by_confidence else ():
        for part in filter(model.has, parts):
            confidence = model.confidence(part)
            if np.isnan(confidence).any():
                continue
            true, predicted = model.predictions(part)
            accuracy = accuracy_of_most_confident(confidence, true == predicted, SHARES_KEPT)
            row = {"model": model.label, "test_set": part_columns(part, results.dataset).test_set}
            rows += [
                {**row, "kept": share, "accuracy": value}
                for share, value in zip(SHARES_KEPT, accuracy, strict=True)
            ]
    columns = {"model": "Model", "test_set": "Tested on", "kept": "Predictions kept"}
    return table_of("confidence", "Confident predictions", rows, **columns, accuracy="Accuracy")


def confidence_finding(results: TaskResults) -> str:
    """Return the accuracy of all, and of the most confident, predictions of the shown model.

    The most confident ones are the smallest share with `MIN_CONFIDENT` predictions.
    """
    table = confidence_table(results)
    labels = table.column("model")
    shown = shown_model(results)
    model = shown if shown.label in labels else models_of(results)[0]
    rows = table.where(model=model.label).rows[: len(SHARES_KEPT)]
    count = len(model.recordings())
    enough = [row for row in rows if count * row["kept"] >= MIN_CONFIDENT] or rows[-1:]
    total = f"accuracy {number(100 * rows[-1]['accuracy'])} % of {count} predictions"
    kept = math.ceil(count * enough[0]["kept"])
    best = f"{number(100 * enough[0]['accuracy'])} % of the {kept} most confident"
    return f"{model.label}: {total}, and {best}"


PLOTS = (
    Plot(
        "matrix",
        class_shares,
        "predictions on held-out grasps",
        value="share",
        x="true",
        series=("predicted",),
        over="the recordings of a true class",
        title=finding,
        name="predictions",
    ),
    Plot(
        "lines",
        numbers,
        "predictions of each model on held-out grasps; periodic targets: the repetition nearest to "
        "the true value",
        value="predicted",
        x="true",
        series=("values",),
        panel="model",
        cells={"model": "label"},
        over="predictions of a true value",
        chance="mean",
        chance_label="A guess predicts",
        ideal=True,
        title=finding,
        name="predictions",
    ),
    Plot(
        "scatter",
        run_times,
        "error against CPU time of training; grey line: no model is better in both",
        value="error",
        x="train_cpu_s",
        cells={"model": "label"},
        chance="chance",
        chance_label="Error of a guess:",
        title=finding,
        name="run-time",
    ),
    Plot(
        "lines",
        confidence_table,
        "accuracy on held-out recordings, if only the predictions with the highest probability of "
        "the predicted class are kept",
        value="accuracy",
        x="kept",
        panel="test_set",
        over="",
        cells={"model": "label", "test_set": "data set"},
        percent=("accuracy", "kept"),
        title=confidence_finding,
        name="confidence",
    ),
)


# Rows and words


def rows(results: TaskResults) -> Iterator[ResultRow]:
    """Yield a row for each model on the grouped split, then on each further part; known and
    withheld values together, and the random split, only if the paper reports them."""
    models = models_of(results)
    top = best_of(models)
    for model in models:
        yield ResultRow(
            model.label,
            results.metric_title,
            model.shown(model.score(), GROUPED),
            model.shown(Score(model.chance(), 0.0)),
            number(model.cost.train_cpu_s),
            number(model.cost.prediction_ms),
            best=model is top,
            paper=results.papers.get(TASK_PARTS[GROUPED][0]),
            answer=model.shown(model.with_interval(), GROUPED) if model is top else "",
            marks=marks_of([model], model, GROUPED),
            unit=results.shown_unit,
            controls=controls(model),
        )
    yield from session_rows(models)
    yield from placebo_rows(models)
    for part in dict.fromkeys(part for model in models for part, _ in model.parts[1:]):
        name = part_columns(part, results.dataset).test_set
        key, heading = TASK_PARTS.get(part) or (name, f"tested on {results.other_sets[name].title}")
        if part in (RANDOM, OVERALL) and key not in results.papers:
            continue
        for model in (model for model in models if model.has(part)):
            yield ResultRow(
                model.label,
                f"{results.metric_title}, {words(key)}",
                model.shown(model.score(part), part),
                model.shown(Score(model.chance(part), 0.0)),
                part=heading,
                paper=results.papers.get(key),
            )


def session_rows(models: Sequence[ModelResult]) -> Iterator[ResultRow]:
    """Yield a row for each model and part with held-out sessions."""
    for part, (name, heading) in SESSION_PARTS.items():
        for model in models:
            if model.has(part):
                yield ResultRow(
                    model.label,
                    f"{model.task.metric_title}, {name}",
                    model.shown(model.score(part), part),
                    model.shown(Score(model.chance(part), 0.0)),
                    part=heading,
                )


def placebo_rows(models: Sequence[ModelResult]) -> Iterator[ResultRow]:
    """Yield a row for each model and split of the placebo."""
    for split, name in PLACEBO_SPLITS.items():
        for model in models:
            part = model.placebo_part(split)
            if model.has(part):
                yield ResultRow(
                    model.label,
                    f"{model.task.metric_title}, {name}",
                    model.shown(model.with_interval(part)),
                    model.shown(Score(model.chance(part), 0.0)),
                    part=PLACEBO_HEADING,
                )


def controls(model: ModelResult, part: str = GROUPED) -> str:
    """Return the result with held-out sessions and the placebo of a part, in words; "" without."""
    texts = []
    sessions = model.in_sessions(part)
    if sessions is not None:
        texts.append(f"held-out sessions {model.shown(sessions)}")
    level = model.placebo(part)
    if level is not None:
        text = f"placebo {model.shown(level)}"
        in_sessions = model.placebo(SESSIONS)
        if in_sessions is not None:
            text += f", in held-out sessions {model.shown(in_sessions)}"
        texts.append(text)
    return "; ".join(texts)


def summary(results: TaskResults) -> str:
    """Return two sentences: the evaluated recordings, and the best model."""
    models = models_of(results)
    top = best_of(models)
    counts = models[0].result.about["parts"][GROUPED]
    task = results.task_settings
    unit = f" in {task.unit}" if task.unit else ""
    return (
        f"{task.kind.capitalize()} of {task.target}{unit} from "
        f"{counts['recordings']:,} recordings in {counts['groups']:,} groups ({task.groups}), "
        f"{counts['folds']} folds. "
        f"Lowest error: {top.label}, {results.metric_title} {top.shown(top.score())}."
        f"{axes_sentence(top)}{augment_sentence(results)}"
        f"{covariates_sentence(results)}"
        f"{placement_sentence(results, top)}{unmeasured_sentence(results)}"
    )


def axes_sentence(model: ModelResult) -> str:
    """Return a sentence with the error of each axis of a vector; "" for one column."""
    axes = model.task.task_settings.axes
    if not axes:
        return ""
    errors = ", ".join(f"{axis} {model.shown(model.axis_score(axis))}" for axis in axes)
    return f" This is the error of the Euclidean distance; by axis: {errors}."


def augment_sentence(results: TaskResults) -> str:
    """Return the changed copies that models are also trained on; "" if there are none."""
    augment = results.task_settings.augment
    if augment is None:
        return ""
    return f" Models are also trained on {augment.text}; no copy is tested."


def covariates_sentence(results: TaskResults) -> str:
    """Return the covariates of a task and the score that they have alone; "" without covariates."""
    covariates = results.task_settings.covariates
    if not covariates:
        return ""
    text = f" Models also get {' and '.join(covariates)}."
    shown = shown_model(results)
    for model in models_of(results):
        if model.result.model == COVARIATES_ALONE:
            score = model.shown(model.score())
            text += f" Without the sound, a model of these has {results.metric_title} {score}."
            if shown.label != model.label and model.error() <= shown.error():
                text += f" This is at least as good as {shown.label} with the sound."
    return text


def placement_sentence(results: TaskResults, model: ModelResult) -> str:
    """Return the problem of the design of a classification, with the scores of its controls."""
    design = design_of(results)
    if design is None or not design.problem:
        return ""
    scores = controls(model)
    text = f" Note: {design.problem}"
    return f"{text} ({scores})." if scores else f"{text}."


def unmeasured_sentence(results: TaskResults) -> str:
    """Return a sentence with the controls that could not be measured, and the reasons."""
    reasons = {
        f"{name}: {reason}": None
        for result in results.results
        for name, reason in result.about.get("unmeasured", {}).items()
    }
    if not reasons:
        return ""
    return f" Not measured: {'; '.join(reasons)}."


def design_of(results: TaskResults) -> Design | None:
    """Return the design of the recordings of a classification with a grouped split by grasp.

    Return None for a regression, and for a task that holds out sessions or groups of a label.
    """
    stored = results.results[0].about.get("design")
    task = results.task_settings
    is_by_grasp = task.kind == "classification" and task.groups == "grasp_id"
    return Design(**stored) if stored and is_by_grasp else None


def advice(results: TaskResults) -> Iterator[str]:
    """Yield the next recordings to make: for the design, then for the most confused classes.

    If the score in held-out sessions is below that of held-out grasps, the model recognises
    placements or sessions. Then more grasps do not help, and more sessions are proposed.
    """
    design = design_of(results)
    if design is not None and design.problem:
        yield f"{sentence(design.problem)}: {design.fix}."
    model = shown_model(results)
    sessions = model.in_sessions()
    if sessions is not None and falls(model, sessions):
        yield (
            f"Accuracy falls from {model.shown(model.score())} to {model.shown(sessions)} in "
            f"held-out sessions: record more placements and sessions, not more grasps."
        )
        return
    rows = class_shares(results).rows
    wrong = [row for row in rows if row["true"] != row["predicted"] and row["share"] >= CONFUSED]
    for row in sorted(wrong, key=lambda row: -row["share"])[:MAX_CONFUSED]:
        share = number(100 * row["share"], 2)
        yield (
            f"{share} % of the recordings of {row['true']} are predicted as {row['predicted']}: "
            "record more grasps of both, in more poses."
        )


def falls(model: ModelResult, sessions: Score) -> bool:
    """Return whether the interval with held-out sessions is below the value of held-out grasps."""
    is_class = model.task.task_settings.kind == "classification"
    return is_class and sessions.has_interval and sessions.high < model.score().mean


def marks_of(models: Sequence[ModelResult], first: ModelResult, part: str) -> tuple[Mark, ...]:
    """Return the marks of a part of a task: a model, the best other model, chance and controls."""
    scale = first.task.scale
    marks = [mark_of("ours", first.with_interval(part), scale)]
    compared = [m for m in models if m.result.model != first.result.model and m.has(part)]
    if compared:
        best = min(compared, key=lambda model: model.error(part))
        marks.append(mark_of("baseline", best.with_interval(part), scale))
    chance = first.chance(part)
    if math.isfinite(chance):
        marks.append(mark_of("chance", Score(chance, 0.0), scale))
    sessions = first.in_sessions(part)
    level = first.placebo(part)
    if sessions is not None:
        marks.append(mark_of("sessions", sessions, scale))
    if level is not None:
        marks.append(mark_of("placebo", level, scale))
    return tuple(marks)
