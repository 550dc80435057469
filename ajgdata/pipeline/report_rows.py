"""Documents of the further experiments -> what the report says of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ajgdata.models import model_label
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import documents_of
from ajgdata.report.content import SkippedTask
from ajgdata.report.further import (
    About,
    ChanceTest,
    CurveLine,
    Curves,
    Energies,
    EnergyPart,
    SortingPart,
    SortingResult,
    StftPoint,
    StftResult,
    TransferLine,
    Transfers,
)
from ajgdata.report.paper import PaperFigure
from ajgdata.store.files import read_json
from ajgdata.types import DatasetSpec, Task

#: What a further experiment is called, by its kind.
WORDS = {
    "curves": "learning curve",
    "permutations": "test against chance",
    "sorting": "sorting",
    "stft": "settings of the STFT",
    "energies": "energies",
    "transfers": "transfer to other grippers",
}


def _about(spec: DatasetSpec, task: str, document: Mapping[str, Any]) -> About:
    title = f"{spec.title or spec.name} · {task.replace('_', ' ')}"
    return About(spec.name, task, title, document["provenance"]["source"])


def _label(document: Mapping[str, Any]) -> str:
    model = document["model"]
    return model_label(model, document["kind"]) if model else ""


def _paper(task: Task, part: str, paper: Mapping[str, PaperFigure]) -> PaperFigure | None:
    return paper[task.papers[part]] if part in task.papers else None


def left_out(paths: Paths, spec: DatasetSpec, task: str) -> list[SkippedTask]:
    """Further experiments on a task that could not be made, and why."""
    skipped = []
    for one in documents_of(paths, {spec.name: spec}, [(spec.name, task)]):
        document = read_json(one.path)
        if "skipped" in document:
            what = f"{task}, {WORDS[one.kind]}"
            skipped.append(SkippedTask(spec.name, what, _label(document), document["skipped"]))
    return skipped


def energies_of(
    paths: Paths, spec: DatasetSpec, task: str, paper: Mapping[str, PaperFigure]
) -> list[Energies]:
    """Energies by class, if the task asks for them and they could be made."""
    settings = spec.tasks[task]
    if not settings.energy or "skipped" in (document := read_json(paths.energies(spec.name, task))):
        return []
    return [
        Energies(
            about=_about(spec, task, document),
            reference=document["reference"],
            band_hz=tuple(document["band_hz"]),
            parts=tuple(_energy(part) for part in document["parts"]),
            paper=_paper(settings, "energies", paper),
        )
    ]


def transfers_of(
    paths: Paths,
    spec: DatasetSpec,
    task: str,
    specs: Mapping[str, DatasetSpec],
    paper: Mapping[str, PaperFigure],
) -> list[Transfers]:
    """A task's models on other grippers in one figure; none where none could be made."""
    settings = spec.tasks[task].calibrate
    models = settings.models if settings else ()
    documents = [read_json(paths.transfer(spec.name, task, model)) for model in models]
    made = [document for document in documents if "skipped" not in document]
    if not made:
        return []
    share = made[0]["metric"] == "accuracy"
    return [
        Transfers(
            about=_about(spec, task, made[0]),
            metric=made[0]["metric"],
            unit="%" if share else made[0]["unit"],
            folds=made[0]["folds"],
            lines=tuple(
                _transfer(document, name, specs[name].title or name, 100 if share else 1)
                for name in made[0]["on"]
                for document in made
            ),
            paper=_paper(spec.tasks[task], "transfers", paper),
        )
    ]


def _transfer(document: Mapping[str, Any], name: str, title: str, scale: float) -> TransferLine:
    points, metric = document["on"][name], document["metric"]
    sizes = sorted({point["grasps"] for point in points})
    score = scale * np.array(
        [[p["scores"][metric] for p in points if p["grasps"] == n] for n in sizes]
    )
    home = scale * np.array([p["home"][metric] for p in points if p["home"]])
    return TransferLine(
        model_label=_label(document),
        dataset=name,
        title=title,
        grasps=np.array(sizes),
        mean=score.mean(axis=1),
        sd=score.std(axis=1, ddof=1),
        home=(home.mean(), home.std(ddof=1)) if len(home) > 1 else (np.nan, np.nan),
        chance=scale * float(np.mean([point["chance"][metric] for point in points])),
    )


def _energy(part: Mapping[str, Any]) -> EnergyPart:
    sd = np.nan if part["sd"] is None else part["sd"]
    return EnergyPart(part["label"], part["groups"], part["mean"], sd, part["by_object"])


def curves_of(
    paths: Paths, spec: DatasetSpec, task: str, paper: Mapping[str, PaperFigure]
) -> list[Curves]:
    """The learning curves of a task in one figure; none where none could be made."""
    settings = spec.tasks[task].curve
    models = settings.models if settings else ()
    documents = [read_json(paths.curve(spec.name, task, model)) for model in models]
    made = [document for document in documents if "skipped" not in document]
    if not made or not settings:
        return []
    metric = made[0]["metric"]
    share = metric == "accuracy"
    chance = [point["chance"][metric] for point in made[0]["points"]]
    return [
        Curves(
            about=_about(spec, task, made[0]),
            metric=metric,
            unit="%" if share else made[0]["unit"],
            repeats=settings.repeats,
            chance=(100 if share else 1) * float(np.mean(chance)),
            lines=tuple(_line(document, 100 if share else 1) for document in made),
            paper=_paper(spec.tasks[task], "curves", paper),
        )
    ]


def _line(document: Mapping[str, Any], scale: float) -> CurveLine:
    groups = np.array([point["groups"] for point in document["points"]])
    score = scale * np.array([p["scores"][document["metric"]] for p in document["points"]])
    sizes = np.unique(groups)
    mean = np.array([score[groups == n].mean() for n in sizes])
    sd = np.array([score[groups == n].std(ddof=1) for n in sizes])
    return CurveLine(_label(document), sizes, mean, sd)


def tests_of(paths: Paths, spec: DatasetSpec, task: str) -> list[ChanceTest]:
    """The test of a task against chance, if it has one and it could be made."""
    if not spec.tasks[task].permutations:
        return []
    document = read_json(paths.permutations(spec.name, task))
    if "skipped" in document:
        return []
    return [
        ChanceTest(
            about=_about(spec, task, document),
            model_label=_label(document),
            metric=document["metric"],
            unit=document["unit"],
            value=document["value"],
            null=np.array(document["null"]),
            p=document["p"],
        )
    ]


def stfts_of(paths: Paths, spec: DatasetSpec, task: str) -> list[StftResult]:
    """Settings of the STFT on a task, if it asks for them and they could be compared."""
    if not spec.tasks[task].stft:
        return []
    document = read_json(paths.stft(spec.name, task))
    if "skipped" in document:
        return []
    share = document["kind"] == "classification"
    metric = "accuracy" if share else "rmse"
    scale, offset = (-100, 100) if share else (1, 0)
    points, models = document["points"], document["points"][0]["models"]
    costs = read_json(paths.stft_cost(spec.name, task))
    chance = next(iter(models.values()))["chance"][metric]
    return [
        StftResult(
            about=_about(spec, task, document),
            model_labels=tuple(_label({**document, "model": model}) for model in models),
            metric=metric,
            unit="%" if share else document["unit"],
            chance=offset + scale * chance,
            points=tuple(
                _stft_point(point, 1e3 * cost["feature_s_per_recording"], metric, scale, offset)
                for point, cost in zip(points, costs, strict=True)
            ),
        )
    ]


def _stft_point(
    point: Mapping[str, Any], feature_ms: float, metric: str, scale: float, offset: float
) -> StftPoint:
    errors = tuple(
        (offset + scale * one["mean"][metric], abs(scale) * one["sd"][metric])
        for one in point["models"].values()
    )
    band = tuple(point["band_hz"]) if point["band_hz"] else None
    return StftPoint(point["window"], point["hop"], band, point["bins"], feature_ms, errors)


def sorting_of(
    paths: Paths, spec: DatasetSpec, task: str, paper: Mapping[str, PaperFigure]
) -> list[SortingResult]:
    """Sorting by each model that a task asks for."""
    settings = spec.tasks[task].sorting
    documents = [
        read_json(paths.sorting(spec.name, task, model))
        for model in (settings.models if settings else ())
    ]
    return [
        SortingResult(
            about=_about(spec, task, document),
            model=document["model"],
            model_label=_label(document),
            objects=tuple(document["objects"]),
            threshold=document["threshold"],
            recordings=document["recordings"],
            accuracy=document["plain"]["accuracy"],
            parts=(_part("as they are", document["plain"]), _scaled(document)),
            paper=_paper(spec.tasks[task], "sorting", paper),
        )
        for document in documents
        if "skipped" not in document
    ]


def _scaled(document: Mapping[str, Any]) -> SortingPart:
    from ajgdata.evaluate.calibration import TEMPERATURES

    temperatures: Sequence[float] = document["temperatures"]
    middle = float(np.median(temperatures))
    # where all grasps are told apart no temperature is too low
    at_end = sum(any(math.isclose(t, e, rel_tol=1e-3) for e in TEMPERATURES) for t in temperatures)
    told = f", in {at_end} of {len(temperatures)} folds at the end of the search" if at_end else ""
    return _part(f"scaled, temperature {middle:.2g}{told}", document["scaled"])


def _part(label: str, part: Mapping[str, Any]) -> SortingPart:
    accuracy = part["accepted"]["accuracy"]
    return SortingPart(
        label=label,
        confidence=np.array([one["confidence"] for one in part["bins"]]),
        right=np.array([one["accuracy"] for one in part["bins"]]),
        calibration_error=part["calibration_error"],
        accepted_share=part["accepted"]["share"],
        accepted_accuracy=np.nan if accuracy is None else accuracy,
        sorts=np.array(part["sorts"]),
        before_mistake=np.array(part["before_mistake"]),
    )
