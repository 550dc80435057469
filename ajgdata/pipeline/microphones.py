"""Choice of the microphone of a new data set: which channel of its files is used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal

from ajgdata.features.channels import (
    MAX_LEVEL_DB,
    MIN_CORRELATION,
    ChannelStatistics,
    channel_statistics,
)
from ajgdata.store.audio import AudioError, check_channels, read_channels
from ajgdata.store.importing import Contents
from ajgdata.store.scan import Scan
from ajgdata.types import AudioSettings, DataError
from ajgdata.types.errors import many
from ajgdata.types.settings import Microphone, microphone_text, numbers_of

#: Most files whose channels are compared, spread evenly over the folder: the cost of an import does
#: not grow with the number of files.
MAX_COMPARED_FILES = 32
#: Longest part of a file whose channels are compared, in s.
MAX_COMPARED_S = 5.0
#: Most values (frames times channels) of a file that are compared.
MAX_COMPARED_VALUES = 4_000_000


#: Value of `audio.microphone` of a new data set, or all channels of its files.
RequestedMicrophone = Microphone | Literal["all"]
_CHOICES = "a number from 1, numbers such as 1,2, all, or mean"


def check_microphone(path: Path, audio: AudioSettings, requested: RequestedMicrophone) -> None:
    """Raise DataError if a microphone is requested that a declared data set does not use."""
    if requested == "all" and isinstance(audio.microphone, tuple):
        return  # files with other numbers of channels are remarks of the import
    if requested is not None and requested != audio.microphone:
        declared = "no microphone" if audio.microphone is None else f"{audio.microphone}"
        problem = f"{requested} is not the microphone of {path}, which declares {declared}"
        fix = "change audio.microphone there, or import into another data set"
        raise DataError("--microphone", problem, fix)


def chosen_microphone(
    scanned: Scan, contents: Contents, requested: RequestedMicrophone
) -> Microphone:
    """Return `audio.microphone` for the files of a folder; every choice becomes a remark.

    Without a request, files with one channel need no microphone, and channels that contain nearly
    the same sound are averaged. Raises DataError with level and correlation of each channel if the
    sounds differ, and if no file has the requested microphones. Different numbers of channels, and
    each file that cannot be used with the choice, are remarks `channels`.
    """
    counts = {path: info.channels for path, (_, info) in contents.items() if info}
    microphone = _all_channels(scanned, counts) if requested == "all" else requested
    if requested is None and min(counts.values()) > 1:
        statistics = _statistics(scanned, counts)
        _check_alike(scanned, statistics)
        microphone = "mean"
    number = max(numbers_of(microphone), default=1)
    largest = max(counts.values())
    if number > largest:
        problem = f"microphone {number} is not in the files, which have up to {largest} channels"
        raise DataError("--microphone", problem, "choose a smaller number, or mean")
    _note_choice(scanned, counts, microphone, is_guess=requested is None)
    return microphone


def _all_channels(scanned: Scan, counts: dict[Path, int]) -> Microphone:
    """Return the microphones of all channels.

    Raises DataError for files with different numbers of channels.
    """
    numbers = set(counts.values())
    if len(numbers) > 1:
        problem = f"has files with {_numbers(counts)} channels"
        raise DataError(scanned.folder, problem, "name the microphones, e.g. --microphone 1,2")
    count = numbers.pop()
    return None if count == 1 else tuple(range(1, count + 1))


def _statistics(scanned: Scan, counts: dict[Path, int]) -> ChannelStatistics | None:
    """Return level and correlation of the channels; None if nothing in the files can be compared.

    Raises DataError for files with different numbers of channels.
    """
    if len(set(counts.values())) > 1:
        fix = f"add --microphone with {_CHOICES}"
        raise DataError(scanned.folder, f"has files with {_numbers(counts)} channels", fix)
    return compared_channels(scanned, list(counts))


def compared_channels(scanned: Scan, files: Sequence[Path]) -> ChannelStatistics | None:
    """Return level and correlation of the channels of files with equal numbers of channels.

    Return None if nothing in the files can be compared.
    """
    step = max(1, -(-len(files) // MAX_COMPARED_FILES))
    recordings = []
    for path in sorted(files)[::step]:
        with suppress(AudioError):  # the import lists it
            recordings.append(
                read_channels(scanned.folder / path, MAX_COMPARED_S, MAX_COMPARED_VALUES)
            )
    return channel_statistics(recordings)


def _check_alike(scanned: Scan, statistics: ChannelStatistics | None) -> None:
    """Note the measured values. Raise DataError unless the channels have nearly the same sound."""
    if statistics is None:
        fix = f"add --microphone with {_CHOICES}"
        raise DataError(scanned.folder, "has files with several channels without sound", fix)
    if not statistics.are_alike:
        numbers = ", ".join(str(n) for n in range(1, len(statistics.level_dbfs) + 1))
        fix = (
            f"add --microphone with one of {numbers}, with all (the features of each channel), or "
            "with mean"
        )
        raise DataError(scanned.folder, channel_difference(statistics), fix)
    scanned.remarks["note"].append(("channels", statistics.text()))


def channel_difference(statistics: ChannelStatistics) -> str:
    """Return why the channels of a folder are not averaged, with the measured values."""
    text = (
        f"its channels differ by more than {MAX_LEVEL_DB:g} dB or correlate by less than "
        f"{MIN_CORRELATION:g}, so they are not averaged ({statistics.text()})"
    )
    if statistics.have_opposite_signs:
        text += "; they have opposite signs, which cancel in the mean"
    return text


def _note_choice(
    scanned: Scan, counts: dict[Path, int], microphone: Microphone, *, is_guess: bool
) -> None:
    """Add remarks: the choice for files with several channels, different numbers of channels, and
    files that cannot be used with the choice."""
    if max(counts.values()) == 1 and microphone is None:
        return
    if microphone == "mean":
        choice = "the mean of all channels is used"
    elif microphone is None:
        choice = "none: one channel is used"
    else:
        verb = "are" if isinstance(microphone, tuple) else "is"
        choice = f"{microphone_text(microphone)} {verb} used"
    if is_guess:
        choice += "; to change it, edit this key in dataset.yaml"
    scanned.remarks["note"].append(("audio.microphone", choice))
    if len(set(counts.values())) > 1:
        reason = (
            f"{_numbers(counts)} channels: recordings that differ in this may not be comparable"
        )
        scanned.remarks["channels"].append(("files have", reason))
    note_unusable_files(scanned, counts, microphone)


def note_unusable_files(scanned: Scan, counts: dict[Path, int], microphone: Microphone) -> None:
    """Add a remark for each file that cannot be used with the microphone of the data set."""
    for path, count in sorted(counts.items()):
        try:
            check_channels(path, count, microphone)
        except AudioError as error:
            reason = f"{error.problem}; a run will quarantine it; {error.fix}"
            scanned.remarks["channels"].append((path.as_posix(), reason))


def _numbers(counts: dict[Path, int]) -> str:
    """Return the numbers of channels in a folder with their numbers of files."""
    files = Counter(counts.values())
    return " and ".join(f"{count} ({many(files[count], 'file')})" for count in sorted(files))
