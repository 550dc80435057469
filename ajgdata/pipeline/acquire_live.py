"""Sound card and robot opened, or the virtual gripper; a protocol -> a recorded session."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from ajgdata.acquire.card import DEVICE, Card, card_settings
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.guided import GuidedAcquisition, Outcome
from ajgdata.acquire.line import open_card
from ajgdata.acquire.live_session import live_session
from ajgdata.acquire.operator import Operator
from ajgdata.acquire.protocol import plan_protocol, remaining
from ajgdata.acquire.robot import Confirm, Robot, open_robot
from ajgdata.acquire.virtual_line import VirtualTable
from ajgdata.paths import EXCITATION_FILE, Paths
from ajgdata.store.audio import pcm24_bytes, read_audio
from ajgdata.store.files import sha256_of
from ajgdata.store.sessions import (
    check_one_kind,
    list_sessions,
    read_dataset,
    read_recordings,
    read_session,
)
from ajgdata.types import NAME, AudioSettings, DataError, DatasetSpec, GraspProtocol

_NAME = re.compile(r"soundcard-(\d+)")
_NAMES = "use letters, digits, _ and -"
VIRTUAL = "virtual"


def acquire_live(
    paths: Paths,
    dataset: str,
    session: str,
    *,
    device: Mapping[str, Any],
    operator: Operator,
    notes: str = "",
    temperature_c: float | None = None,
    allow: Callable[[str], bool] = lambda text: False,
) -> tuple[str, Outcome]:
    """Record the missing grasps of the protocol of `dataset` into `session`; "": see
    `session_name`.

    `device` are keys of `CardSettings` except the rate, which the data set declares. `notes` and
    the temperature of the room are for session.yaml. `allow`
    decides whether the robot of a data set from elsewhere may start, of which it gets a
    description. Returns the session's name and the outcome. Raises DataError for whatever cannot be
    recorded.
    """
    spec = read_dataset(paths, dataset)
    protocol = protocol_of(paths, spec)
    _check_robot(paths, dataset, protocol, allow)
    if not operator.attended:
        _refuse_what_needs_a_person(paths.dataset(dataset), protocol, device["device"])
    simulated = device["device"] == DEVICE
    check_one_kind(paths, spec, list_sessions(paths, dataset), adding=simulated)
    session = session or session_name(paths, dataset, protocol)
    if not NAME.fullmatch(session):
        raise DataError("--session", f"no session can have the name {session!r}", _NAMES)
    settings = card_settings(sample_rate_hz=spec.audio.sample_rate_hz, **device)
    sound = excitation_of(paths.dataset(dataset), spec)
    setup = {
        # Settings of the robot may hold hosts and tokens, and a time limit may be raised.
        "protocol": protocol.model_dump(mode="json", exclude={"robot_settings"}),
        "device": settings.model_dump(mode="json", exclude={"attempts"}),
        "excitation": spec.excitation.model_dump(mode="json"),
        "excitation_sha256": sha256_of(pcm24_bytes(sound, settings.sample_rate_hz)),
    }
    about = {"gripper": protocol.gripper, "medium": protocol.medium, "device": settings.device}
    folder = paths.session(dataset, session)
    with (
        live_session(
            folder, setup=setup, excitation=sound, played=spec.excitation,
            sample_rate_hz=settings.sample_rate_hz, about=about,
        ) as live,
        open_robot(protocol.robot, protocol.robot_settings, operator.confirm) as robot,
        open_card(settings) as card,
    ):  # fmt: skip
        card.resume(live.latency_samples)
        live.note(notes)
        if temperature_c is not None:
            live.about(temperature_c=temperature_c)
        audio = AudioSettings(sample_rate_hz=settings.sample_rate_hz)
        acquisition = GuidedAcquisition(
            session=live,
            planned=plan_protocol(protocol, session),
            protocol=protocol,
            targets=spec.targets,
            window=spec.features.window,
            card=card,
            played=read_audio(folder / EXCITATION_FILE, audio).samples,  # as it is stored
            robot=robot,
            operator=operator,
        )
        try:
            return session, acquisition.run()
        finally:
            live.note_card(**known_of(card))


def _check_robot(
    paths: Paths, dataset: str, protocol: GraspProtocol, allow: Callable[[str], bool]
) -> None:
    """Raise DataError for a robot of a data set from elsewhere, unless the user allows it."""
    from_elsewhere = paths.fetched_sums(dataset).is_file() or paths.source(dataset).is_file()
    if protocol.robot == "manual" or not from_elsewhere:
        return
    settings = json.dumps(protocol.robot_settings)
    if not allow(f"{dataset} was fetched. Its robot {protocol.robot!r} would start: {settings}"):
        problem = f"the robot {protocol.robot!r} of a fetched data set was not allowed to start"
        fix = "check protocol.robot_settings, then run it at a terminal, without --yes"
        raise DataError(paths.dataset(dataset), problem, fix)


def _refuse_what_needs_a_person(path: Path, protocol: GraspProtocol, device: str) -> None:
    """Raise DataError for a protocol that nobody can follow."""
    if asked := [name for name, moment in protocol.ask.items() if moment != "later"]:
        fix = "write `later`, or leave out --yes"
        raise DataError(path, f"protocol.ask: {asked[0]} needs a person", fix)
    if protocol.robot == "manual" and device != DEVICE:  # the virtual gripper harms no data
        fix = "name the robot that places the objects, or leave out --yes"
        raise DataError(path, "protocol.robot: manual needs a person", fix)


def excitation_of(path: Path, spec: DatasetSpec) -> NDArray[np.float64]:
    """Return the samples (n,) that a data set plays, at its rate."""
    try:
        return excitation_samples(spec.excitation, spec.audio.sample_rate_hz)
    except ValueError as error:
        raise DataError(path, str(error), "change it, or audio.sample_rate_hz") from None


def known_of(card: Card) -> dict[str, Any]:
    """Return the description of the sound card as arguments of `LiveSession.note_card`."""
    description = dict(card.describe())
    settings = card.settings.model_dump(mode="json")
    latency = description.pop("latency_samples", None)
    driver = {key: value for key, value in description.items() if key not in settings}
    return {"driver": driver, "latency_samples": latency}


def protocol_of(paths: Paths, spec: DatasetSpec) -> GraspProtocol:
    """Return the protocol of a data set. Raises DataError if it has none, or audio that a session
    cannot have."""
    path = paths.dataset(spec.name)
    if spec.protocol is None:
        raise DataError(path, "has no protocol", "add one, as in docs/tutorial.md")
    return spec.protocol


def session_name(paths: Paths, dataset: str, protocol: GraspProtocol) -> str:
    """Return the last session of the sound card if something of it is left, else the next name."""
    numbers = [
        int(found[1]) for name in list_sessions(paths, dataset) if (found := _NAME.fullmatch(name))
    ]
    last = f"soundcard-{max(numbers, default=0):02d}"
    if numbers:
        folder = paths.session(dataset, last)
        skipped = read_session(folder).skipped
        if remaining(plan_protocol(protocol, last), read_recordings(folder)[0], skipped):
            return last
    return f"soundcard-{max(numbers, default=0) + 1:02d}"


@contextmanager
def open_hands(
    paths: Paths,
    spec: DatasetSpec,
    *,
    source: str,
    card: Mapping[str, Any],
    robot: str,
    robot_settings: Mapping[str, JsonValue],
    seed: int,
    confirm: Confirm,
) -> Iterator[tuple[Robot, Card, dict[str, str]]]:
    """Yield robot and sound card, and `gripper` and `medium` as session.yaml has them.

    `source` is `soundcard` (`card` has its settings, but the rate, which the data set declares) or
    `virtual`: the virtual gripper over the objects of the data set's recipe, drawn by `seed`, which
    no person needs to move. Raises DataError.
    """
    if source == VIRTUAL:
        if spec.recipe is None:
            fix = "name a data set that has one, or use a sound card"
            raise DataError(paths.dataset(spec.name), "has no recipe to simulate", fix)
        about = {"gripper": "virtual", "medium": "virtual"}
        if robot == "manual":
            table = VirtualTable(spec.recipe, seed, paths.responses)
            yield table, table, about
            return
        with open_robot(robot, robot_settings, confirm) as mover:
            table = VirtualTable(spec.recipe, seed, paths.responses, mover)
            yield table, table, about
        return
    settings = card_settings(**{**card, "sample_rate_hz": spec.audio.sample_rate_hz})
    protocol = spec.protocol
    about = {
        "gripper": protocol.gripper if protocol else "unknown",
        "medium": protocol.medium if protocol else "unknown",
    }
    with open_robot(robot, robot_settings, confirm) as mover, open_card(settings) as opened:
        yield mover, opened, about
