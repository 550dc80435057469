"""Record a session of a protocol with a sound card, or with the virtual gripper."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

from ajgdata.acquire.card import CardSettings, Sound
from ajgdata.acquire.guided import AcquisitionOutcome, GuidedAcquisition
from ajgdata.acquire.live_session import (
    LiveSession,
    excitation_of,
    live_session,
    recorded_microphone,
)
from ajgdata.acquire.operator import Operator
from ajgdata.acquire.protocol import plan_protocol, remaining
from ajgdata.acquire.robot import Confirm, Robot, make_robot
from ajgdata.acquire.sound_card import open_card
from ajgdata.acquire.virtual import Card, VirtualTable
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.gripper.object_library import OBJECTS
from ajgdata.gripper.scene import derive_seed
from ajgdata.paths import EXCITATION_FILE, Paths
from ajgdata.store.audio import read_audio
from ajgdata.store.sessions import (
    check_one_source,
    list_sessions,
    read_dataset,
    read_session,
    read_table,
    require_waveforms,
)
from ajgdata.types import (
    AudioSettings,
    DataError,
    DatasetSpec,
    GraspProtocol,
    PassiveRecording,
)
from ajgdata.types.base import checked
from ajgdata.types.documentation import documentation
from ajgdata.types.names import checked_name
from ajgdata.types.protocol import RobotProgram
from ajgdata.types.recipe import Recipe, RecipeObject
from ajgdata.types.settings import Microphone, as_written

SOUNDCARD = "soundcard"
VIRTUAL = "virtual"
#: Keys of session.yaml of a session of the virtual gripper.
SIMULATED = {"gripper": VIRTUAL, "medium": VIRTUAL, "source": VIRTUAL}


def acquire_live(
    paths: Paths,
    dataset: str,
    session: str,
    *,
    operator: Operator,
    source: str = SOUNDCARD,
    device: Mapping[str, Any] | None = None,
) -> tuple[str, AcquisitionOutcome]:
    """Record the missing grasps of a protocol; return the session's name and the outcome.

    An empty `session` means `session_name`. `source` is `soundcard` or `virtual`. For a sound card,
    `device` has the keys of `CardSettings` except the rate, which the data set declares. The
    virtual gripper is robot and sound card, so no person and no program moves it. Raises DataError
    if recording is impossible.
    """
    spec = read_dataset(paths, dataset)
    require_waveforms(spec, "ajgdata record")
    protocol = protocol_of(paths, spec)
    is_virtual = source == VIRTUAL
    if not is_virtual:
        _check_robot(paths, dataset, protocol, operator)
    elif spec.recipe is not None:
        fix = f"use `ajgdata simulate {dataset}`"
        raise DataError(paths.dataset(dataset), "has a recipe for the virtual gripper", fix)
    _check_recordable(paths.dataset(dataset), spec.audio)
    check_one_source(paths, spec, list_sessions(paths, dataset), adding=is_virtual)
    session = checked_name(session or session_name(paths, dataset, protocol, source), "session")
    folder = paths.session(dataset, session)
    # The robot's command may contain hosts and tokens, and its time limit may be raised. The shapes
    # do not change recordings of a sound card.
    stored = protocol.model_dump(mode="json", exclude={"robot"})
    robot: Robot
    card_opener: AbstractContextManager[Card]
    if is_virtual:
        table = _virtual_table(paths, spec, protocol, session)
        robot = table
        settings = table.settings
        card_opener = nullcontext(table)
        about = SIMULATED
    else:
        for item in stored["objects"]:
            del item["shape"]
        robot = make_robot(protocol.robot, operator.confirm)
        keys = {"sample_rate_hz": spec.audio.sample_rate_hz, **(device or {})}
        settings = checked(CardSettings, "sound card", keys)
        card_opener = open_card(settings)
        about = gripper_of(spec)
    sound = excitation_of(paths, spec)
    with (
        live_session(folder, spec, sound, settings, {"protocol": stored}, about) as live,
        card_opener as card,
    ):
        card.resume(live.latency_samples)
        acquisition = GuidedAcquisition(
            session=live,
            planned=plan_protocol(protocol, session),
            protocol=protocol,
            targets=spec.label_targets.keys() - {"object"},  # it has its own column
            features=spec.features,
            card=card,
            played=sound_of_session(folder, spec),
            robot=robot,
            operator=operator,
        )
        try:
            return session, acquisition.run()
        finally:
            store_card(live, card)


def _virtual_table(
    paths: Paths, spec: DatasetSpec, protocol: GraspProtocol, session: str
) -> VirtualTable:
    """Return the virtual gripper over the objects of a protocol.

    Poses and noise are drawn from the protocol's seed, the names of data set and session, and the
    number of recordings, so a session that is resumed does not repeat the noise. Raises DataError
    for an object without a shape, and for another sample rate than that of the simulation.
    """
    file = paths.dataset(spec.name)
    if spec.audio.sample_rate_hz != SAMPLE_RATE_HZ:
        problem = f"audio.sample_rate_hz is not {SAMPLE_RATE_HZ}, the rate of the virtual gripper"
        raise DataError(file, problem, "use another data set for the virtual gripper")
    objects = []
    for item in protocol.objects:
        shape = item.shape or item.name
        if isinstance(shape, str) and shape not in OBJECTS:
            problem = f"protocol.objects: the virtual gripper has no object {shape!r}"
            fix = (
                "add its shape, e.g. `shape: {kind: cube, edge_mm: 20}`, or use one of "
                f"{', '.join(OBJECTS)}"
            )
            raise DataError(file, problem, fix)
        objects.append(RecipeObject(name=item.name, shape=shape))
    recipe = Recipe(grasps_per_object=protocol.grasps_per_object, objects=tuple(objects))
    folder = paths.session(spec.name, session)
    n_recordings = len(read_table(folder)[0]) if folder.is_dir() else 0
    seed = derive_seed(protocol.seed, spec.name, session, n_recordings)
    return VirtualTable(recipe, seed, paths.responses)


def _check_robot(paths: Paths, dataset: str, protocol: GraspProtocol, operator: Operator) -> None:
    """Raise DataError for the robot of a fetched data set, and if a person is needed but absent."""
    if protocol.robot is None:
        if not operator.attended:
            fix = "set protocol.robot to a program that places the objects, or omit --yes"
            raise DataError(paths.dataset(dataset), "a person must move the gripper", fix)
    elif paths.fetched_sums(dataset).is_file() or paths.source(dataset).is_file():
        problem = "the robot of a fetched data set does not start"
        fix = "check protocol.robot, then copy the protocol to a data set of your own"
        raise DataError(paths.dataset(dataset), problem, fix)


def sound_of_session(folder: Path, spec: DatasetSpec) -> Sound:
    """Return what a card plays in a session: the excitation (n,), float32, as it is stored in 24
    bits, or the settings of passive recording."""
    if isinstance(spec.excitation, PassiveRecording):
        return spec.excitation
    audio = AudioSettings(sample_rate_hz=spec.audio.sample_rate_hz)
    return read_audio(folder / EXCITATION_FILE, audio).samples


def gripper_of(spec: DatasetSpec) -> dict[str, str]:
    """Return gripper, medium and source of a protocol, for session.yaml."""
    about = {key: getattr(spec.protocol, key, "unknown") for key in ("gripper", "medium")}
    return {**about, "source": SOUNDCARD}


def store_card(live: LiveSession, card: Card) -> None:
    """Enter driver and latency of a sound card into session.yaml."""
    about = dict(card.describe())
    latency = about.pop("latency_samples", None)
    driver = {key: value for key, value in about.items() if not hasattr(card.settings, key)}
    live.update_acquisition(driver=driver, latency_samples=latency)


def protocol_of(paths: Paths, spec: DatasetSpec) -> GraspProtocol:
    """Return the protocol of a data set. Raises DataError if it has none."""
    if spec.protocol is None:
        fix = f"add one, as in {documentation('tutorial')}"
        raise DataError(paths.dataset(spec.name), "has no protocol", fix)
    return spec.protocol


def session_name(paths: Paths, dataset: str, protocol: GraspProtocol, source: str) -> str:
    """Return the last session of a source if it has remaining grasps, else the next name.

    The names are `source` and a number, for example soundcard-01.
    """
    matches = (re.fullmatch(rf"{source}-(\d+)", name) for name in list_sessions(paths, dataset))
    number = max((int(match[1]) for match in matches if match), default=0)
    if number:
        last = f"{source}-{number:02d}"
        folder = paths.session(dataset, last)
        skipped = read_session(folder).skipped
        if remaining(plan_protocol(protocol, last), read_table(folder)[0], skipped):
            return last
    return f"{source}-{number + 1:02d}"


@contextmanager
def open_hands(
    paths: Paths,
    spec: DatasetSpec,
    *,
    source: str,
    card: Mapping[str, Any],
    robot: RobotProgram | None,
    seed: int,
    confirm: Confirm,
    rate_hz: int,
    microphone: Microphone,
) -> Iterator[tuple[Robot, Card, dict[str, str]]]:
    """Yield robot and sound card, and `gripper`, `medium` and `source` for session.yaml.

    `source` is `soundcard` or `virtual`. For a sound card, `card` has its settings except the rate,
    which the data set declares. `virtual` is the virtual gripper over the objects of the data set's
    recipe; `seed` draws its grasps, and it needs no person. `microphone` is that of the model: it
    is used if `card` has none, and the microphone of the sessions if the model has none either.
    Raises DataError, for example for another sample rate than `rate_hz` of the model, and for a
    model of several microphones.
    """
    if source == VIRTUAL:
        if spec.recipe is None:
            fix = "name a data set that has one, or use a sound card"
            raise DataError(paths.dataset(spec.name), "has no recipe to simulate", fix)
        moving = make_robot(robot, confirm) if robot else None
        table = VirtualTable(spec.recipe, seed, paths.responses, moving)
        _check_rate(table, rate_hz)
        yield table, table, SIMULATED
        return
    own = {"sample_rate_hz": spec.audio.sample_rate_hz, **card}
    if "microphone" not in own or isinstance(microphone, str | tuple):
        own["microphone"] = _card_microphone(paths, spec, microphone)
    settings = checked(CardSettings, "sound card", own)
    with open_card(settings) as opened:
        _check_rate(opened, rate_hz)
        yield make_robot(robot, confirm), opened, gripper_of(spec)


def _card_microphone(paths: Paths, spec: DatasetSpec, microphone: Microphone) -> int:
    """Return the number of the microphone with which a model was trained.

    This is `microphone`, or without it the microphone of the sessions of the sound card, or 1
    without such sessions. Raises DataError for sessions of different microphones, and for a model
    of several microphones or their mean, because a sound card records one.
    """
    if isinstance(microphone, str | tuple):
        used_text = "the mean of all microphones" if microphone == "mean" else "several microphones"
        problem = f"the model was trained with {used_text}, a sound card records one"
        fix = "set audio.microphone in dataset.yaml to a number and train the model again"
        raise DataError("audio.microphone", problem, fix)
    if microphone is not None:
        return microphone
    used: dict[int, str] = {}
    for name in list_sessions(paths, spec.name):
        number = recorded_microphone(read_session(paths.session(spec.name, name)))
        if number is not None:
            used.setdefault(number, name)
    if len(used) > 1:
        listed = ", ".join(f"{number} ({name})" for number, name in sorted(used.items()))
        problem = f"its sessions were recorded with several microphones: {listed}"
        fix = "choose one with --microphone, or with card.microphone in a plan of `ajgdata sort`"
        raise DataError(paths.dataset(spec.name), problem, fix)
    return next(iter(used), 1)


def _check_recordable(path: Path, audio: AudioSettings) -> None:
    """Raise DataError if a data set declares another channel than that of a sound card."""
    if audio.microphone not in (None, 1):
        written = as_written(audio.microphone)
        problem = f"audio.microphone is {written}, and a sound card writes one channel"
        fix = "record into another data set; `ajgdata record --microphone` chooses the input"
        raise DataError(path, problem, fix)


def _check_rate(card: Card, rate_hz: int) -> None:
    """Raise DataError if a sound card records at another sample rate than that of the model."""
    card_hz = card.settings.sample_rate_hz
    if card_hz != rate_hz:
        problem = f"records at {card_hz} Hz, and the model was trained at {rate_hz} Hz"
        fix = "train the model again, or correct audio.sample_rate_hz of the data set"
        raise DataError(card.settings.device, problem, fix)
