"""Plan of sorting -> a run with everything opened: model, sound card, robot, session, log."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ajgdata.acquire.live_session import live_session
from ajgdata.acquire.robot import Confirm
from ajgdata.acquire.virtual import Card
from ajgdata.live.control import Control
from ajgdata.live.drift import REFERENCES_NEEDED, DriftWatch
from ajgdata.live.events import EventLog, Listener, shown_spectrum
from ajgdata.live.kept import KeptRun, class_of, labels_of
from ajgdata.live.predictor import Predictor
from ajgdata.live.sort import Outcome, Sorter, arrivals
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire_live import (
    VIRTUAL,
    open_hands,
    store_card,
    stored_excitation,
)
from ajgdata.store.features import read_store
from ajgdata.store.sessions import check_one_kind, list_sessions, read_dataset
from ajgdata.types import DataError, DatasetSpec
from ajgdata.types.plan import NOTHING, SortPlan

_NAME = re.compile(r"sort-(\d+)")
NO_ALARM = (
    f"no alarm for a changed gripper: the model has fewer than {REFERENCES_NEEDED} references; "
    "record the empty gripper more often and train again"
)


@dataclass(frozen=True)
class OpenRun:
    """A run that is ready: its loop, and the contents of the event `start`."""

    sorter: Sorter
    name: str  #: DATASET/SESSION that keeps the recordings
    log_file: Path
    start: Mapping[str, Any]

    def run(self) -> Outcome:
        """Sort until it ends (see live.sort.Sorter.run), in the main thread."""
        log, plan = self.sorter.log, self.sorter.plan
        log.say("start", **self.start)
        if self.sorter.watch is None and plan.references:
            log.say("problem", text=NO_ALARM)
        return self.sorter.run(arrivals(plan))


@contextmanager
def open_run(
    paths: Paths, plan: SortPlan, *, confirm: Confirm, control: Control, listen: Listener
) -> Iterator[OpenRun]:
    """Open all that a plan needs, and close it at the end, whatever ends it.

    `confirm` asks the person, `listen` receives every event. Raises DataError for a plan that
    cannot be followed, before anything moves.
    """
    spec = read_dataset(paths, plan.dataset)
    predictor = sorting_model(paths, spec, plan)
    sessions = list_sessions(paths, spec.name)
    check_one_kind(paths, spec, sessions, adding=plan.source == VIRTUAL)
    session = _next_name(paths, spec.name)
    folder, log_file = paths.session(spec.name, session), paths.events(spec.name, session)
    target = spec.tasks[plan.task].target
    # Settings of the robot may contain hosts and tokens.
    settings = plan.model_dump(mode="json", exclude={"robot", "card"})
    setup = {"sort": {**settings, "target": target}}
    with (
        open_hands(
            paths, spec, source=plan.source, card=plan.card, robot=plan.robot, seed=plan.seed,
            confirm=confirm,
        ) as (robot, card, gripper),
        live_session(folder, spec, card.settings, setup, gripper) as live,
        EventLog(log_file) as log,
    ):  # fmt: skip
        log.listen(listen)
        played = stored_excitation(folder, card.settings.sample_rate_hz)
        kept = KeptRun(live, lambda name: labels_of(spec, target, name))
        truth = lambda name: class_of(spec, target, name) or name  # noqa: E731
        known = predictor.references
        watch = DriftWatch(known) if len(known) >= REFERENCES_NEEDED else None
        sorter = Sorter(plan, predictor, card, played, robot, kept, log, control, truth, watch)
        start = {**_start_event(paths, spec, plan, predictor, card), "session": session}
        try:
            yield OpenRun(sorter, f"{spec.name}/{session}", log_file, start)
        finally:
            store_card(live, card)


def sorting_model(paths: Paths, spec: DatasetSpec, plan: SortPlan) -> Predictor:
    """Return the model of a plan. DataError for one that cannot sort, and for bins that are not
    those of its classes."""
    from ajgdata.loading import load_predictor

    where = f"plan for {spec.name}"
    if plan.task not in spec.tasks:
        known = ", ".join(spec.tasks) or "none"
        raise DataError(paths.dataset(spec.name), f"no task {plan.task!r}", f"declared: {known}")
    predictor = load_predictor(spec.name, plan.task, plan.model, paths.root)
    if predictor.kind != "classification" or not predictor.has_probabilities:
        fix = "sort by a task of classes, with a model such as cnn or linear"
        raise DataError(where, f"{plan.task}, {plan.model} gives no probabilities", fix)
    classes = list(predictor.classes)
    if missing := [one for one in classes if one not in plan.bins]:
        raise DataError(where, f"bins: no bin for {missing[0]}", "name one for each class")
    if more := [one for one in plan.bins if one not in classes]:
        problem = f"bins: the model knows no {more[0]}"
        raise DataError(where, problem, f"its classes are {', '.join(classes)}")
    target = spec.tasks[plan.task].target
    for name in plan.objects:
        if name != NOTHING and class_of(spec, target, name) is None:
            fix = f"name objects of {paths.dataset(spec.name)}"
            raise DataError(where, f"objects: nobody knows the {target} of {name}", fix)
    return predictor


def _next_name(paths: Paths, dataset: str) -> str:
    live = paths.events(dataset, "x").parent.parent
    names = [*list_sessions(paths, dataset), *(p.name for p in live.glob("*"))]
    numbers = [int(found[1]) for name in names if (found := _NAME.fullmatch(name))]
    return f"sort-{max(numbers, default=0) + 1:02d}"


def _start_event(
    paths: Paths, spec: DatasetSpec, plan: SortPlan, predictor: Predictor, card: Card
) -> dict[str, Any]:
    """Return the contents of the event `start`."""
    return {
        "dataset": plan.dataset,
        "task": plan.task,
        "model": plan.model,
        "unit": "",
        "classes": list(predictor.classes),
        "threshold": plan.threshold,
        "bins": {**plan.bins, **({"rejected": plan.reject_bin} if plan.reject_bin else {})},
        "looks": plan.looks,
        "device": card.settings.device,
        "robot": "command" if plan.robot else "manual",
        "source": "simulated" if plan.source == VIRTUAL else "recorded",
        **_means(paths.features(spec.name), spec.tasks[plan.task].target, predictor.classes),
    }


def _means(store: Path, target: str, classes: Sequence[str]) -> dict[str, Any]:
    """Return the mean spectrum of each class as trained on, for whoever draws it; {} without the
    feature store, which sorting does not need."""
    if not store.is_file():
        return {}
    shard = read_store(store)
    value = shard.columns[target].values.astype(str)
    spectra = {
        one: shown_spectrum(shard.feature[value == one].mean(axis=0))
        for one in classes
        if (value == one).any()
    }
    return {"spectra": spectra, "top_hz": float(shard.frequency_hz[-1])}
