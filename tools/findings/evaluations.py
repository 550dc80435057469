"""Blocks on evaluated models, made of metrics.csv."""

import math
from functools import partial
from typing import NamedTuple

from ajgdata.evaluate.agreement import (
    GRASP_INTERVAL,
    NO_BETTER,
    Interval,
    compare,
    is_better_than_chance,
)
from ajgdata.experiments.cross_validation.bands import band_label, part_within
from ajgdata.report.comparison import NEAR_CHANCE, tally_text
from ajgdata.report.format import DASH, Score, mean_sd, number, with_unit
from ajgdata.report.paper import PaperFigure, parse_paper
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import read_dataset

from .markdown import markdown_table
from .results import PROJECT, Results

MODELS = ("cnn", "linear", "knn")


class Row(NamedTuple):
    """A part of an evaluation, and the figure of the paper beside it ("": none)."""

    title: str
    dataset: str
    task: str
    part: str
    paper: str = ""


class Terms(NamedTuple):
    """The metric of a task, its unit, and what it is multiplied with to be shown in it."""

    metric: str
    unit: str
    scale: float


HEADLINES = (
    Row("edge length, 12 cubes seen in training, RMSE", "size", "size", "grouped", "size-known"),
    Row("the same, split by recording", "size", "size", "random", "size-known"),
    Row("edge length, 4 withheld cubes, RMSE", "size", "size", "withheld", "size-unknown"),
    Row("the same in 80 dB(A) of noise, training at 45, one fit", "size", "noise", "on:size_80dba"),
    Row("the same, median of ten fits", "size", "noise", "repeated fits on:size_80dba", "noise"),
    Row(
        "angle of a bar, known angles, RMSE", "orientation", "angle", "grouped", "orientation-known"
    ),
    Row("the same, split by recording", "orientation", "angle", "random", "orientation-known"),
    Row("angle of a bar, withheld angles, RMSE", "orientation", "angle", "withheld", "orientation"),
    Row("the same, learned as sine and cosine, RMSE", "orientation", "direction", "withheld"),
    Row("16 household objects, accuracy", "ycb", "object", "grouped", "ycb"),
    Row("material of 80 mm spheres", "sphere80", "material", "grouped", "materials-sphere80"),
    Row("material of plates", "plate", "material", "grouped", "materials-plate"),
    Row("material of 30 mm spheres", "sphere30", "material", "grouped", "materials-sphere30"),
)
#: Rows of the README; each title is understandable without the other rows.
README_ROWS = (
    Row("Edge length of a cube, RMSE", "size", "size", "grouped", "size-known"),
    Row("Edge length in noise of 80 dB(A), training at 45 dB(A), RMSE", "size", "noise",
        "repeated fits on:size_80dba", "noise"),
    Row("Household object, 16 classes, accuracy", "ycb", "object", "grouped", "ycb"),
    Row("Material of an 80 mm sphere, 4 classes, accuracy", "sphere80", "material", "grouped",
        "materials-sphere80"),
    Row("Angle of a bar, angles withheld from training, RMSE", "orientation", "angle", "withheld",
        "orientation"),
)  # fmt: skip
#: What the choice of the CNN's settings changed (docs/models.md).
CHOSEN = (
    Row("ycb, object", "ycb", "object", "grouped"),
    Row("size, which cube", "size", "cube", "grouped"),
    Row("size, known", "size", "size", "grouped"),
    Row("size, withheld", "size", "size", "withheld"),
    Row("size, at 80 dBA", "size", "noise", "on:size_80dba"),
    Row("size, at 90 dBA", "size", "noise", "on:size_90dba"),
    Row("orientation, known", "orientation", "angle", "grouped"),
    Row("orientation, withheld", "orientation", "angle", "withheld"),
    Row("orientation as direction, known", "orientation", "direction", "grouped"),
    Row("80 mm spheres", "sphere80", "material", "grouped"),
    Row("plates", "plate", "material", "grouped"),
    Row("30 mm spheres", "sphere30", "material", "grouped"),
)


def terms(row: Row) -> Terms:
    """Return the terms of a row's task, as its data set declares the target."""
    spec = read_dataset(PROJECT, row.dataset)
    target = spec.targets[spec.tasks[row.task].target]
    classes = target.kind == "classification"
    return Terms("accuracy", "%", 100) if classes else Terms("rmse", target.unit, 1)


def readme_table(results: Results) -> str:
    """Return five results of the CNN with their 95 % intervals, published values and verdicts."""
    paper = parse_paper(read_paper(PROJECT))
    rows = [
        (
            row.title,
            _with_interval(results, row),
            _paper(paper[row.paper]),
            _chance(results, row),
            _verdict(results, row, paper[row.paper]),
        )
        for row in README_ROWS
    ]
    head = ("CNN, held-out grasps", "simulated (95 % interval)", "paper", "chance level", "verdict")
    return markdown_table(head, rows)


def headline_table(results: Results) -> str:
    """The results beside the paper's, and what training took."""
    paper = parse_paper(read_paper(PROJECT))
    bands = read_dataset(PROJECT, HEADLINES[0].dataset).tasks[HEADLINES[0].task].bands
    rows = [
        [
            row.title,
            *(_score(results, row, model) for model in MODELS),
            *(_score(results, _from_band(row, band), MODELS[0]) for band in bands),
            _chance(results, row),
            _paper(paper[row.paper]) if row.paper else "",
            _verdict(results, row, paper[row.paper]) if row.paper else "",
            f"`{row.dataset}/{row.task}`, {row.part}",
        ]
        for row in HEADLINES
    ]
    times = [results.metric("ycb", "object", m, "cost of grouped", "train_s", "measured") for m in MODELS]  # fmt: skip  # noqa: E501
    told = [DASH if time is None else f"{number(time, 2)} s" for time in times]
    blank = [""] * len(bands)
    label = "training on the 16 objects, all folds, one core"
    rows.append([label, *told, *blank, "", "", "", "`ycb/object`"])
    head = ("*simulated*", "CNN", "ridge or logistic regression", "k-NN",
            *(f"CNN, {band_label(band)} alone" for band in bands), "chance",
            "the paper, CNN, real gripper, 1025 bins of the whole band", "verdict (CNN)",
            "task, split")  # fmt: skip
    counted = tally_text(results.agreements())
    return f"{markdown_table(head, rows)}\nComparison with the paper, all rows: {counted}.\n"


def _from_band(row: Row, band: tuple[float, float]) -> Row:
    return row._replace(part=part_within(row.part, band))


def after_the_choice(results: Results) -> str:
    """What the CNN reaches with the settings that were chosen."""
    names = {"rmse": "RMSE"}
    rows = [
        [row.title, names.get(metric := terms(row).metric, metric), _score(results, row, "cnn")]
        for row in CHOSEN
    ]
    return markdown_table(("task", "metric", "CNN, chosen settings"), rows)


def media(results: Results) -> str:
    """Energy with each granular medium, the empty gripper being 100 %."""
    metric = "energy relative to air"
    rows = []
    for medium in ("plastic", "metal", "coffee"):
        mean, sd = (
            results.metric("media", "reflection", "", f"energy:{medium}", metric, statistic)
            for statistic in ("mean", "sd")
        )
        rows.append([medium, _told(mean, sd, "%", 100)])
    return markdown_table(("granular medium", "energy, empty gripper = 100 %"), rows)


class Values(NamedTuple):
    """A metric of a model on a part: mean, sd over folds, interval over grasps and chance."""

    mean: float | None
    sd: float | None
    interval: Interval
    chance: float
    perfect: float


def _values(results: Results, row: Row, model: str) -> Values:
    metric = terms(row).metric
    value = partial(results.metric, row.dataset, row.task, model, row.part, metric)
    mean, sd, low, high = (value(statistic) for statistic in ("mean", "sd", *GRASP_INTERVAL))
    if mean is None:  # of repeated fits
        mean, low, high = (value(statistic) for statistic in ("median", "low", "high"))
    chance = value("chance")
    ends = (math.nan if end is None else end for end in (low, high))
    guess = math.nan if chance is None else chance
    return Values(mean, sd, Interval(*ends), guess, float(metric == "accuracy"))


def _score(results: Results, row: Row, model: str) -> str:
    _, unit, scale = terms(row)
    mean, sd, interval, chance, perfect = _values(results, row, model)
    if mean is not None and sd is None and interval.is_defined:
        return _with_interval(results, row, model)
    text = _told(mean, sd, unit, scale)
    if mean is None or is_better_than_chance(mean, interval, chance, perfect):
        return text
    return f"{text}, {NO_BETTER}"


def _with_interval(results: Results, row: Row, model: str = MODELS[0]) -> str:
    _, unit, scale = terms(row)
    value, _, interval, chance, perfect = _values(results, row, model)
    if value is None:
        return DASH
    low, high = (number(scale * end, 2) for end in (interval.low, interval.high))
    text = f"{with_unit(number(scale * value, 2), unit)} ({low} to {high})"
    is_better = is_better_than_chance(value, interval, chance, perfect)
    return text if is_better else f"{text}, {NO_BETTER}"


def _verdict(results: Results, row: Row, paper: PaperFigure) -> str:
    """The verdict on the CNN, as the report gives it; a figure `near chance` is chance."""
    mean, _, interval, chance, perfect = _values(results, row, MODELS[0])
    if mean is None or (paper.value is None and paper.text != NEAR_CHANCE):
        return DASH
    published = chance if paper.value is None else paper.value / terms(row).scale
    return compare(mean, interval, published, chance=chance, perfect=perfect)


def _told(mean: float | None, sd: float | None, unit: str, scale: float) -> str:
    if mean is None or sd is None:
        return DASH
    return mean_sd(Score(mean, sd), unit, scale)


def _chance(results: Results, row: Row) -> str:
    """That of the first model that has it: chance looks at the targets alone."""
    metric, unit, scale = terms(row)
    values = (
        results.metric(row.dataset, row.task, model, row.part, metric, "chance") for model in MODELS
    )
    found = next((value for value in values if value is not None), None)
    return DASH if found is None else with_unit(number(scale * found, 2), unit)


def _paper(figure: PaperFigure) -> str:
    if figure.value is None:
        return figure.text
    return with_unit(number(figure.value), figure.unit)
