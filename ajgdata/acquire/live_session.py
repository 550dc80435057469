"""A session of a real gripper on disk. Its recordings stay, however the acquisition ends.

Nobody can record them again. Therefore session.yaml exists from the start, the table is written
after each recording, and no recording is overwritten. An incomplete grasp is rejected and recorded
again under another id. One process at a time records into a session, always with the same setup.
"""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.excitation import played_samples
from ajgdata.acquire.protocol import (
    ATTEMPT,
    PLANNED,
    REFERENCE,
    PlannedGrasp,
    grasp_id,
    next_attempt,
    whole_grasps,
)
from ajgdata.acquire.writer import SETUP_COLUMN, recording_alone
from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, RECORDINGS_FILE, SESSION_FILE, Paths
from ajgdata.store.audio import SIMULATED, file_sha256, pcm24_bytes, write_pcm24
from ajgdata.store.files import replacing_folder, sha256_of
from ajgdata.store.provenance import software
from ajgdata.store.sessions import read_session, read_table, write_recordings, write_session
from ajgdata.types import (
    Acquisition,
    DataError,
    DatasetSpec,
    Excitation,
    PassiveRecording,
    Recording,
    Session,
)

REJECTED = "reject"


class LiveSession:
    """A session that is being recorded; `live_session` opens and closes it."""

    def __init__(self, folder: Path, setup: Mapping[str, Any]) -> None:
        self.folder = folder
        self._setup = sha256_of(json.dumps(setup, sort_keys=True).encode())
        session = read_session(folder)
        self._rate_hz = session.sample_rate_hz or 0
        self._comment = SIMULATED if session.is_simulated else ""

    @property
    def recordings(self) -> list[Recording]:
        """Rows of the table, which a person may edit during the session.

        Raises DataError for an invalid row, because writing the table would lose it.
        """
        rows, findings = read_table(self.folder)
        if findings:
            first = findings[0]
            raise DataError(self.folder / RECORDINGS_FILE, first.problem, first.fix)
        for row in rows:
            number = row.labels.get(ATTEMPT, "")
            if row.labels.get(PLANNED) and not number.isdecimal():
                problem = f"{row.recording_id}: {ATTEMPT} = {number!r}"
                fix = "write the number of the attempt"
                raise DataError(self.folder / RECORDINGS_FILE, problem, fix)
        return rows

    @property
    def latency_samples(self) -> int | None:
        """Latency of its first recording; None without recordings."""
        measured = [
            row for row in self.recordings if row.labels.get("latency_samples", "").isdecimal()
        ]
        if not measured:
            return None
        first = min(measured, key=lambda row: row.labels.get("time", ""))
        return int(first.labels["latency_samples"])

    @property
    def skipped(self) -> Mapping[str, str]:
        """Skipped grasps with the reason."""
        return read_session(self.folder).skipped

    def begin(self, grasp: PlannedGrasp) -> int:
        """Return the number of the next attempt at `grasp`, and reject earlier attempts.

        A file that a killed acquisition wrote, but did not enter into the table, is removed.
        """
        self.reject(grasp)
        number = next_attempt(grasp, self.recordings)
        known = {row.file for row in self.recordings}
        for attempt in (number - 1, number):
            for row in self._planned(grasp, attempt):
                if row.file not in known:
                    (self.folder / row.file).unlink(missing_ok=True)
        return number

    def record(
        self,
        grasp: PlannedGrasp,
        attempt: int,
        sample: int,
        samples: np.ndarray,
        *,
        quality: str,
        labels: Mapping[str, str],
    ) -> None:
        """Write one recording (n,) in [-1, 1] and its row. Raises DataError if the file exists."""
        row = self._planned(grasp, attempt)[sample]
        path = self.folder / row.file
        if path.exists():
            raise DataError(path, "exists already", "move it away; nothing is overwritten")
        write_pcm24(path, samples, self._rate_hz, self._comment)
        update = {
            "quality": quality,
            "labels": {**row.labels, **labels},
            "sha256": file_sha256(path),
        }
        write_recordings(self.folder, [*self.recordings, row.model_copy(update=update)])

    def accept(self, grasp: PlannedGrasp, attempt: int) -> None:
        """Accept the recordings of one attempt, including clipped ones."""

        def accepted(row: Recording) -> Recording:
            if row.labels[ATTEMPT] != str(attempt):
                return row
            clipped = row.labels.get("clipped", "0") not in ("", "0")
            return row.model_copy(update={"quality": "clipped" if clipped else "ok"})

        self._change(grasp, accepted)

    def label(self, grasp: PlannedGrasp, labels: Mapping[str, str]) -> None:
        """Add labels to the recordings of a grasp."""
        self._change(grasp, lambda r: r.model_copy(update={"labels": {**r.labels, **labels}}))

    def reject(self, grasp: PlannedGrasp) -> None:
        """Reject the recordings of a grasp."""
        self._change(grasp, lambda row: row.model_copy(update={"quality": REJECTED}))

    def whole(self, grasp: PlannedGrasp) -> list[Recording]:
        """Return the accepted recordings of a grasp."""
        return whole_grasps(self.recordings).get(grasp.name, [])

    def skip(self, grasp: PlannedGrasp, reason: str) -> None:
        """Reject a grasp, and enter it into `skipped` of session.yaml."""
        self.reject(grasp)
        self._write_session({"skipped": {**self.skipped, grasp.name: reason}})

    def update_acquisition(self, **keys: Any) -> None:
        """Set keys of types.Acquisition in session.yaml."""
        known = read_session(self.folder).acquisition
        if known is not None:
            self._write_session({"acquisition": known.model_copy(update=keys)})

    def _write_session(self, update: Mapping[str, Any]) -> None:
        session = read_session(self.folder).model_copy(update=dict(update))
        write_session(self.folder, session, self.recordings)

    def _change(self, grasp: PlannedGrasp, change: Callable[[Recording], Recording]) -> None:
        """Change the rows of a grasp."""
        rows = self.recordings
        changed = [change(row) if row.labels.get(PLANNED) == grasp.name else row for row in rows]
        if changed != rows:
            write_recordings(self.folder, changed)

    def _planned(self, grasp: PlannedGrasp, attempt: int) -> list[Recording]:
        """Return a row for each sample of an attempt."""
        name = grasp_id(grasp, attempt)
        labels = {
            **{key: str(value) for key, value in grasp.targets.items()},
            PLANNED: grasp.name,
            ATTEMPT: str(attempt),
            REFERENCE: grasp.reference or "",
            SETUP_COLUMN: self._setup,
        }
        return [
            Recording(
                recording_id=f"{name}_{sample + 1}",
                file=f"{AUDIO_FOLDER}/{name}_{sample + 1}.wav",
                grasp_id=name,
                placement_id=grasp.name if grasp.object else "",
                sample=sample,
                object=grasp.object,
                labels=labels,
            )
            for sample in range(grasp.samples)
        ]


def excitation_of(paths: Paths, spec: DatasetSpec) -> np.ndarray | None:
    """Return the samples (n,) of the excitation of a data set, at its rate; None without a sound.

    Raises DataError for a sound that cannot be played.
    """
    if isinstance(spec.excitation, PassiveRecording):
        return None
    try:
        return played_samples(spec.excitation, spec.audio.sample_rate_hz, paths.root)
    except ValueError as error:
        fix = "change it, or audio.sample_rate_hz"
        raise DataError(f"data set {spec.name}", str(error), fix) from None


@contextmanager
def live_session(
    folder: Path,
    spec: DatasetSpec,
    sound: np.ndarray | None,
    card: CardSettings,
    plan: Mapping[str, Any],
    about: Mapping[str, str],
) -> Iterator[LiveSession]:
    """Yield the session at `folder`, and mark it finished at the end.

    A missing session is created. At the end, a session without recordings is removed. The setup
    consists of `plan`, the card and the excitation of `spec`, whose samples are `sound` (n,).
    `about` has gripper, medium and source for session.yaml; `source` is required. Raises DataError
    if another process records into the session, or if the session was recorded with another setup.
    """
    setup = {
        **plan,
        "device": card.model_dump(mode="json", exclude={"attempts"}),
        "excitation": spec.excitation.model_dump(mode="json"),
    }
    if sound is not None:
        setup["excitation_sha256"] = sha256_of(pcm24_bytes(sound, card.sample_rate_hz))
    with recording_alone(folder):
        _discard_if_empty(folder)  # an empty session may have another setup
        if not folder.exists():
            _create(folder, spec, sound, card, setup, about)
        session = LiveSession(folder, _checked_setup(folder, setup))
        session.update_acquisition(finished=False)
        try:
            yield session
        finally:
            if not _discard_if_empty(folder):
                session.update_acquisition(finished=True)


def _create(
    folder: Path,
    spec: DatasetSpec,
    sound: np.ndarray | None,
    card: CardSettings,
    setup: Mapping[str, Any],
    about: Mapping[str, str],
) -> None:
    """Write a session without recordings, and its played `sound` (n,).

    The folder appears when it is complete.
    """
    with replacing_folder(folder) as new:
        (new / AUDIO_FOLDER).mkdir()
        played = None
        level_dbfs = None
        if sound is not None:
            write_pcm24(new / EXCITATION_FILE, sound, card.sample_rate_hz)
            level_dbfs = round(20 * math.log10(float(np.abs(sound).max())), 2)
            played = Excitation(
                file=EXCITATION_FILE,
                sha256=file_sha256(new / EXCITATION_FILE),
                description=spec.excitation.description,
                settings=spec.excitation.model_dump(mode="json"),
            )
        session = Session(
            session_id=folder.name,
            sample_rate_hz=card.sample_rate_hz,
            device=card.device,
            excitation=played,
            software=f"ajgdata {software()['ajgdata_version']}",
            acquisition=Acquisition(finished=False, setup=dict(setup), level_dbfs=level_dbfs),
            **about,
        )
        write_session(new, session, [])


def _discard_if_empty(folder: Path) -> bool:
    """Remove the session if it is of a sound card and has no recording; return whether it was.

    The folder is renamed first, so that no incomplete session remains.
    """
    if not (folder / SESSION_FILE).is_file() or any((folder / AUDIO_FOLDER).glob("[!.]*")):
        return False
    if read_session(folder).acquisition is None or read_table(folder)[0]:
        return False
    hidden = folder.with_name(f".{folder.name}.empty")
    shutil.rmtree(hidden, ignore_errors=True)  # a killed process may have left it
    folder.rename(hidden)
    shutil.rmtree(hidden)
    return True


def _checked_setup(folder: Path, setup: Mapping[str, Any]) -> dict[str, Any]:
    """Return the stored setup of a session. Recordings have the hash of this setup.

    Raises DataError with the differing keys if it is not `setup`.
    """
    session = read_session(folder)
    known = session.acquisition
    fix = "record into another --session"
    if known is None:
        raise DataError(folder, "was not recorded by `ajgdata record --device`", fix)
    present = json.loads(json.dumps(setup))
    stored = _renamed_keys(known.setup)
    differing = [key for key in present if present[key] != stored.get(key)]
    if differing:
        problem = f"was recorded with another setup: {', '.join(differing)}"
        raise DataError(folder, problem, f"restore that, or {fix}")
    if session.excitation is not None:
        played = folder / session.excitation.file
        if file_sha256(played) != session.excitation.sha256:
            raise DataError(played, "is not the played sound (sha256 differs)", "restore it")
    return dict(known.setup)


def recorded_microphone(session: Session) -> int | None:
    """Return the number of the microphone that recorded a session.

    It is None for imported files and for the virtual gripper.
    """
    if session.acquisition is None or session.is_simulated:
        return None
    microphone = _renamed_keys(session.acquisition.setup)["device"].get("microphone")
    return microphone if isinstance(microphone, int) else None


def _renamed_keys(setup: Mapping[str, Any]) -> dict[str, Any]:
    """Return a setup of an older version with the present name of the input channel."""
    device = dict(setup.get("device") or {})
    if "input_channel" in device:
        device["microphone"] = device.pop("input_channel")
    return {**setup, "device": device}
