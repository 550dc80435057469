"""Open what a sorting plan needs: model, sound card, robot, session and log."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ajgdata.acquire.live_session import excitation_of, live_session
from ajgdata.acquire.robot import Confirm
from ajgdata.live.events import EventLog, Listener
from ajgdata.live.predictor import Predictor
from ajgdata.live.sort import Sorter
from ajgdata.live.steps import Control
from ajgdata.loading import load_predictor
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire_live import VIRTUAL, open_hands, sound_of_session, store_card
from ajgdata.store.sessions import check_one_source, list_sessions, read_dataset, require_waveforms
from ajgdata.types import DataError, DatasetSpec
from ajgdata.types.protocol import NOTHING, SortPlan

#: Name of the session of a sorting run, with its number.
_NAME = re.compile(r"sort-(\d+)")


@contextmanager
def open_run(
    paths: Paths, plan: SortPlan, *, confirm: Confirm, control: Control, listen: Listener
) -> Iterator[Sorter]:
    """Open all that a plan needs, yield the sorter, and close everything at the end.

    `confirm` asks the person, and `listen` receives every event. Raises DataError for a plan that
    cannot be followed, before anything moves.
    """
    spec = read_dataset(paths, plan.dataset)
    require_waveforms(spec, "ajgdata sort")
    predictor = sorting_model(paths, spec, plan)
    sessions = list_sessions(paths, spec.name)
    check_one_source(paths, spec, sessions, adding=plan.source == VIRTUAL)
    session = _next_name(paths, spec.name)
    folder = paths.session(spec.name, session)
    target = spec.tasks[plan.task].target
    # Settings of the robot may contain hosts and tokens.
    settings = plan.model_dump(mode="json", exclude={"robot", "card"})
    setup = {"sort": {**settings, "target": target}}
    sound = excitation_of(paths, spec)
    with (
        open_hands(
            paths,
            spec,
            source=plan.source,
            card=plan.card,
            robot=plan.robot,
            seed=plan.seed,
            confirm=confirm,
            rate_hz=predictor.sample_rate_hz,
            microphone=predictor.audio.microphone,
        ) as (robot, card, gripper),
        live_session(folder, spec, sound, card.settings, setup, gripper) as live,
        EventLog(paths.events(spec.name, session)) as log,
    ):
        log.listen(listen)
        sorter = Sorter(
            plan=plan,
            senses=predictor,
            card=card,
            played=sound_of_session(folder, spec),
            robot=robot,
            session=live,
            log=log,
            target=target,
            labels=lambda name: labels_of(spec, target, name),
            control=control,
        )
        try:
            yield sorter
        finally:
            store_card(live, card)


def sorting_model(paths: Paths, spec: DatasetSpec, plan: SortPlan) -> Predictor:
    """Return the model of a plan.

    Raises DataError for a model that cannot sort, for bins that do not match its classes, and for
    objects whose class is unknown.
    """
    where = f"plan for {spec.name}"
    if plan.task not in spec.tasks:
        known = ", ".join(spec.tasks) or "none"
        problem = f"there is no task {plan.task!r}"
        raise DataError(paths.dataset(spec.name), problem, f"use one of {known}")
    predictor = load_predictor(spec.name, plan.task, plan.model, paths.root)
    if predictor.kind != "classification" or not predictor.has_probabilities:
        fix = "sort by a task of classes, with a model such as cnn or linear"
        raise DataError(where, f"{plan.task}, {plan.model} gives no probabilities", fix)
    if predictor.covariates:
        names = ", ".join(covariate.name for covariate in predictor.covariates)
        raise DataError(
            where, f"{plan.task} needs {names} of each grasp", "sort by a task without covariates"
        )
    classes = list(predictor.classes)
    missing = [label for label in classes if label not in plan.bins]
    if missing:
        raise DataError(where, f"bins: no bin for {missing[0]}", "name a bin for each class")
    unknown = [label for label in plan.bins if label not in classes]
    if unknown:
        problem = f"bins: {unknown[0]} is not a class of the model"
        raise DataError(where, problem, f"use its classes: {', '.join(classes)}")
    target = spec.tasks[plan.task].target
    for name in plan.objects:
        if name != NOTHING and target != "object" and not labels_of(spec, target, name):
            fix = f"name objects of {paths.dataset(spec.name)}"
            raise DataError(where, f"objects: the {target} of {name} is unknown", fix)
    return predictor


def _next_name(paths: Paths, dataset: str) -> str:
    """Return the name of the next sorting session: its number is higher than all existing ones.

    A run that recorded no session may have left its events.
    """
    live = paths.events(dataset, "x").parent.parent
    names = [*list_sessions(paths, dataset), *(folder.name for folder in live.glob("*"))]
    matches = [_NAME.fullmatch(name) for name in names]
    numbers = [int(match[1]) for match in matches if match]
    return f"sort-{max(numbers, default=0) + 1:02d}"


def labels_of(spec: DatasetSpec, target: str, name: str) -> dict[str, float | str]:
    """Return the targets of an object in recipe or protocol; {} if they do not give its class."""
    sources = [source for source in (spec.recipe, spec.protocol) if source]
    objects = {item.name: item.targets for source in sources for item in source.objects}
    targets = {**objects.get(name, {}), "object": name}
    if targets.get(target) is None:
        return {}
    targets[target] = str(targets[target])
    # The object has its own column.
    return {key: targets[key] for key in sorted(targets) if key != "object"}
