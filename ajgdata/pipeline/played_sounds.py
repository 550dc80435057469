"""Differences between the played sounds of sessions. A model can mistake them for objects."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from ajgdata.acquire.excitation import played_samples
from ajgdata.paths import DATASET_FILE, SESSION_FILE, Paths
from ajgdata.store.audio import AudioError, file_sha256, inspect_audio, read_channels
from ajgdata.store.sessions import inside, read_session
from ajgdata.types import (
    WHOLE,
    DataError,
    DatasetSpec,
    Excitation,
    ExcitationSpec,
    Finding,
    PassiveRecording,
    SoundFile,
)

#: Largest difference of samples of one sound in two files: a 16-bit file is rounded to 2^-16, a
#: file of another bit depth to less, and some programs scale by 32767 instead of 32768.
SAME_SAMPLES = 2.0**-14
#: Longest played sound that is compared, in s: twice the longest declared sound.
MAX_PLAYED_S = 240.0
#: Most values (frames times channels) of a played sound that are compared.
MAX_PLAYED_VALUES = 50_000_000
_CODE = "played_sound"
_SEPARATE = "import or record sessions with another played sound into another data set"


@dataclass(frozen=True)
class PlayedSound:
    """The played sound of a session: its file, and its entry in session.yaml."""

    session_id: str
    path: Path
    about: Excitation


def played_sound_issues(paths: Paths, spec: DatasetSpec, names: list[str]) -> Iterator[Finding]:
    """Yield a warning for each session with an unreadable or different played sound, and one if the
    sound that dataset.yaml declares cannot be played, for example because its file is missing.

    Sounds are compared with the sound of the first session, and with `excitation` of dataset.yaml.
    Imported sounds are compared with `excitation` only if dataset.yaml declares it, because its
    default is not necessarily the sound that was played. A session without a played sound is
    compared with `excitation` if a sound card recorded it.
    """
    reason = _not_playable(paths, spec)
    if reason is not None:
        yield Finding(DATASET_FILE, WHOLE, "", "warning", _CODE, reason.problem, reason.fix)
    sounds: list[PlayedSound] = []
    for name in names:
        try:
            sound = _played_sound(paths.session(spec.name, name))
        except DataError as error:
            yield _warning(name, error.where, error.problem, error.fix)
            continue
        if isinstance(sound, PassiveRecording):
            difference = _difference(sound, spec)
            if difference is not None:
                problem = f"was recorded with {sound.description}, not with `excitation` of "
                problem += f"{DATASET_FILE} ({difference})"
                fix = f"correct `excitation`, or {_SEPARATE}"
                yield _warning(name, SESSION_FILE, problem, fix)
        elif sound is not None:
            sounds.append(sound)
    for sound in sounds:
        file = sound.path.name
        if not _equal(sounds[0], sound):
            first = sounds[0]
            problem = (
                f"the played sound {_named(sound)} differs from that of session "
                f"{first.session_id}, {_named(first)}"
            )
            yield _warning(sound.session_id, file, problem, _SEPARATE)
        difference = _difference_from_declared(paths, sound, spec)
        if difference is not None:
            problem = (
                f"the played sound {_named(sound)} is not `excitation` of {DATASET_FILE} "
                f"({difference})"
            )
            fix = f"correct `excitation`, or {_SEPARATE}"
            yield _warning(sound.session_id, file, problem, fix)


def _not_playable(paths: Paths, spec: DatasetSpec) -> DataError | None:
    """Return the reason why the file that dataset.yaml declares cannot be played, or None."""
    if not isinstance(spec.excitation, SoundFile):
        return None
    try:
        played_samples(spec.excitation, spec.audio.sample_rate_hz, paths.root)
    except DataError as error:
        return error
    return None


def _warning(session: str, file: object, problem: str, fix: str) -> Finding:
    """Return a warning about the played sound of a session."""
    return Finding(session, WHOLE, Path(str(file)).name, "warning", _CODE, problem, fix)


def _played_sound(folder: Path) -> PlayedSound | PassiveRecording | None:
    """Return the played sound of a session, or its settings of passive recording.

    Return None if the sound is unknown, or if session.yaml cannot be read, which is another issue.
    Raises DataError if the sha256 of the file differs from session.yaml.
    """
    try:
        session = read_session(folder)
    except DataError:
        return None
    played = session.excitation
    if played is None:
        setup = {} if session.acquisition is None else session.acquisition.setup
        stored = _declaration(setup.get("excitation"))
        return stored if isinstance(stored, PassiveRecording) else None
    path = inside(folder, played.file)
    if file_sha256(path) != played.sha256:
        problem = "is not the played sound that session.yaml names (sha256 differs)"
        raise DataError(path, problem, "restore the file")
    return PlayedSound(folder.name, path, played)


def _named(sound: PlayedSound) -> str:
    """Return the description of a played sound with its hash, in brackets."""
    text = sound.about.description or sound.about.file
    return f"({text}, sha256 {sound.about.sha256[:8]}…)"


def _equal(first: PlayedSound, second: PlayedSound) -> bool:
    """Return whether two sessions played the same sound. The formats of the files may differ."""
    if first.about.sha256 == second.about.sha256:
        return True
    if _rate_hz(first) != _rate_hz(second):
        return False
    return _same_samples(_samples(first), _samples(second))


def _rate_hz(sound: PlayedSound) -> int:
    """Return the sample rate of a played sound; 0 if it cannot be decoded."""
    try:
        return inspect_audio(sound.path).sample_rate_hz
    except AudioError:
        return 0


def _samples(sound: PlayedSound) -> NDArray[np.float32]:
    """Return the samples (frames, channels) of a played sound; none if it cannot be decoded."""
    try:
        return read_channels(sound.path, MAX_PLAYED_S, MAX_PLAYED_VALUES)
    except AudioError:
        return np.zeros((0, 1), np.float32)


def _same_samples(first: NDArray[Any], second: NDArray[Any]) -> bool:
    """Return whether two sounds (frames, channels) have the same samples. Empty ones have not."""
    if first.shape != second.shape or not len(first):
        return False
    return float(np.abs(first - second).max()) <= SAME_SAMPLES


def _difference_from_declared(paths: Paths, sound: PlayedSound, spec: DatasetSpec) -> str | None:
    """Return the difference between a played sound and dataset.yaml; None without a difference.

    Return None also if dataset.yaml or session.yaml has no settings to compare.
    """
    settings = sound.about.settings
    if settings is not None:
        stored = _declaration(settings)
        return None if stored is None else _difference(stored, spec)
    if "excitation" not in spec.model_fields_set:
        return None
    try:
        declared = played_samples(spec.excitation, _rate_hz(sound), paths.root)
    except DataError as error:
        return error.problem
    except ValueError as error:
        return str(error)
    if _same_samples(_samples(sound), declared[:, np.newaxis]):
        return None
    return "its samples differ"


def _declaration(settings: Any) -> ExcitationSpec | None:
    """Return the excitation that a session stores; None for settings of another version."""
    adapter: TypeAdapter[ExcitationSpec] = TypeAdapter(ExcitationSpec)
    try:
        return adapter.validate_python(settings)
    except ValidationError:
        return None


def _difference(stored: ExcitationSpec, spec: DatasetSpec) -> str | None:
    """Return the settings of an excitation that differ from dataset.yaml, with both values.

    Return None without a difference. Of another kind, only the kind is named. The name of a file is
    not compared, but its checksum.
    """
    if isinstance(spec.excitation, SoundFile) and not spec.excitation.sha256:
        return None  # the file is missing, which is a warning of its own
    own = stored.model_dump(exclude={"file"})
    declared = spec.excitation.model_dump(exclude={"file"})
    keys = list(dict.fromkeys([*own, *declared]))
    if own["kind"] != declared["kind"]:
        keys = ["kind"]
    differing = [
        f"{key} {own.get(key)}, declared {declared.get(key)}"
        for key in keys
        if own.get(key) != declared.get(key)
    ]
    return ", ".join(differing) or None
