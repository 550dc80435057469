"""Check the channels of a folder that is added to a declared data set."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.pipeline.microphones import channel_difference, compared_channels, note_unusable_files
from ajgdata.store.audio import inspect_audio
from ajgdata.store.importing import Contents
from ajgdata.store.scan import Scan
from ajgdata.store.sessions import audio_path, list_sessions, read_session, read_table
from ajgdata.types import DataError
from ajgdata.types.settings import Microphone


def check_added_channels(
    paths: Paths,
    dataset: str,
    scanned: Scan,
    contents: Contents,
    microphone: Microphone,
    *,
    is_requested: bool,
) -> None:
    """Compare the channels of a folder with the `microphone` of the data set it is added to.

    Files with other numbers of channels than the data set, and files that lack the microphone, are
    remarks `channels`. Raises DataError if new files have channels with different sounds that
    would be averaged, unless the user requested the mean (`is_requested`).
    """
    counts = {path: info.channels for path, (_, info) in contents.items() if info}
    digests, stored_counts = _stored(paths, dataset)
    new_counts = {path: counts[path] for path in counts if contents[path][0] not in digests}
    if microphone == "mean" and not is_requested:
        _check_mean(scanned, new_counts)
    _note_other_numbers(scanned, new_counts, stored_counts)
    note_unusable_files(scanned, counts, microphone)


def _stored(paths: Paths, dataset: str) -> tuple[set[str], set[int]]:
    """Return the sha256 of all recordings, and the numbers of channels of the first readable
    recording of each session."""
    digests: set[str] = set()
    counts: set[int] = set()
    for name in list_sessions(paths, dataset):
        folder = paths.session(dataset, name)
        with suppress(DataError):
            session = read_session(folder)
            recordings, _ = read_table(folder)
            digests.update(row.sha256 for row in recordings)
            for row in recordings[:1]:
                counts.add(inspect_audio(audio_path(folder, session, row)).channels)
    return digests, counts


def _check_mean(scanned: Scan, counts: dict[Path, int]) -> None:
    """Raise DataError if channels of files with one number of channels have different sounds."""
    for count in sorted(set(counts.values()) - {1}):
        files = [path for path, number in counts.items() if number == count]
        statistics = compared_channels(scanned, files)
        if statistics is not None and not statistics.are_alike:
            fix = "import the folder into another data set, or add --microphone mean"
            raise DataError(scanned.folder, channel_difference(statistics), fix)


def _note_other_numbers(scanned: Scan, counts: dict[Path, int], stored_counts: set[int]) -> None:
    """Add a remark for files whose number of channels other recordings do not have."""
    numbers = set(counts.values())
    other_numbers = stored_counts - numbers
    if not numbers or (len(numbers) == 1 and not other_numbers):
        return
    reason = _listed(numbers)
    if other_numbers:
        reason += f", and other recordings of the data set have {_listed(other_numbers)}"
    reason += ": recordings that differ in this may not be comparable"
    scanned.remarks["channels"].append(("files have", reason))


def _listed(numbers: set[int]) -> str:
    """Return numbers of channels in words."""
    return " or ".join(map(str, sorted(numbers))) + (" channel" if numbers == {1} else " channels")
