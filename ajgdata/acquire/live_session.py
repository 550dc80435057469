"""A session of a real gripper on disk: what is recorded stays, whatever ends the acquisition.

Unlike what is simulated it cannot be made again. Hence session.yaml is there from the start, the
table is written after each recording, a recording is never overwritten, and a grasp of which
something is missing is rejected and made anew under another id.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.acquire.protocol import (
    ATTEMPT,
    PLANNED,
    REFERENCE,
    PlannedGrasp,
    grasp_id,
    next_attempt,
    whole_grasps,
)
from ajgdata.acquire.session_setup import (
    check_setup,
    create,
    discard,
    is_empty,
    recording_alone,
    setup_digest,
)
from ajgdata.acquire.writer import SETUP_COLUMN
from ajgdata.paths import AUDIO_FOLDER, RECORDINGS_FILE
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.files import remove_stale
from ajgdata.store.sessions import read_recordings, read_session, write_recordings, write_session
from ajgdata.types import DataError, ExcitationSpec, Recording

REJECTED = "reject"


class LiveSession:
    """A session that is being recorded; `live_session` opens and closes it."""

    def __init__(self, folder: Path, setup: Mapping[str, Any]) -> None:
        self.folder = folder
        self._setup = setup_digest(setup)
        self._rate_hz = read_session(folder).sample_rate_hz or 0

    @property
    def recordings(self) -> list[Recording]:
        """Every row of the table, which may be edited by hand during the session."""
        return _table(self.folder)

    @property
    def latency_samples(self) -> int | None:
        """Latency that was taken out of its first recording; None if there is none."""
        cut = [r for r in self.recordings if r.labels.get("latency_samples", "").isdecimal()]
        first = min(cut, key=lambda row: row.labels.get("time", ""), default=None)
        return None if first is None else int(first.labels["latency_samples"])

    @property
    def skipped(self) -> Mapping[str, str]:
        """Grasps that shall not be made, and why."""
        return read_session(self.folder).skipped

    def begin(self, grasp: PlannedGrasp) -> int:
        """Return the number of the attempt at `grasp` that comes now.

        Earlier recordings of the grasp are rejected. A file that a killed acquisition wrote and did
        not enter into the table is removed.
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
    ) -> Recording:
        """Write one recording (n,) in [-1, 1] and its row. Raises DataError if there is one."""
        row = self._planned(grasp, attempt)[sample]
        path = self.folder / row.file
        if path.exists():
            raise DataError(path, "is there already", "move it away; nothing is overwritten")
        write_pcm24(path, samples, self._rate_hz)
        changes = {"quality": quality, "labels": {**row.labels, **labels}}
        row = row.model_copy(update={**changes, "sha256": file_sha256(path)})
        write_recordings(self.folder, [*self.recordings, row])
        return row

    def accept(self, grasp: PlannedGrasp, attempt: int) -> None:
        """Take the recordings of one attempt for good, be they clipped."""

        def accepted(row: Recording) -> Recording:
            if row.labels[ATTEMPT] != str(attempt):
                return row
            clipped = row.labels.get("clipped", "0") not in ("", "0")
            return row.model_copy(update={"quality": "clipped" if clipped else "ok"})

        self._change(grasp, accepted)

    def label(self, grasp: PlannedGrasp, labels: Mapping[str, str]) -> None:
        """Give the recordings of a grasp further labels."""
        self._change(grasp, lambda r: r.model_copy(update={"labels": {**r.labels, **labels}}))

    def reject(self, grasp: PlannedGrasp) -> None:
        """Reject what there is of a grasp."""
        self._change(grasp, lambda row: row.model_copy(update={"quality": REJECTED}))

    def whole(self, grasp: PlannedGrasp) -> list[Recording]:
        """Return the recordings of a grasp that count."""
        return whole_grasps(self.recordings).get(grasp.name, [])

    def skip(self, grasp: PlannedGrasp, reason: str) -> None:
        """Note that a grasp shall not be made."""
        self.reject(grasp)
        skipped = {**self.skipped, grasp.name: reason}
        self._write_session({"skipped": skipped})

    def about(self, **keys: Any) -> None:
        """Note what is known of the acquisition now (keys of types.Acquisition)."""
        known = read_session(self.folder).acquisition
        if known is not None:
            self._write_session({"acquisition": known.model_copy(update=keys)})

    def note_card(self, driver: Mapping[str, Any], latency_samples: int | None) -> None:
        """Note what the sound card says of itself, and its latency."""
        self.about(driver=dict(driver), latency_samples=latency_samples)

    def note(self, words: str) -> None:
        """Add a line to the operator's notes, unless they say it already."""
        notes = read_session(self.folder).notes
        if words and words not in notes.splitlines():
            self._write_session({"notes": f"{notes}\n{words}".strip()})

    def _write_session(self, update: Mapping[str, Any]) -> None:
        session = read_session(self.folder).model_copy(update=dict(update))
        write_session(self.folder, session, self.recordings)

    def _change(self, grasp: PlannedGrasp, change: Callable[[Recording], Recording]) -> None:
        rows = self.recordings
        mine = [change(row) if row.labels.get(PLANNED) == grasp.name else row for row in rows]
        if mine != rows:
            write_recordings(self.folder, mine)

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
                sample=sample,
                object=grasp.object,
                labels=labels,
            )
            for sample in range(grasp.samples)
        ]


@contextmanager
def live_session(
    folder: Path,
    *,
    setup: Mapping[str, Any],
    excitation: np.ndarray,
    played: ExcitationSpec,
    sample_rate_hz: int,
    about: Mapping[str, Any],
) -> Iterator[LiveSession]:
    """Yield the session at `folder`, made if there is none, and mark it finished at the end; one
    that holds no recording then is removed.

    `excitation` (n,) in [-1, 1] is the sound that `played` declares, `about` further keys of
    types.Session. Raises DataError if another process records into it, or if it was recorded with
    another setup.
    """
    with recording_alone(folder):
        if is_empty(folder):  # whatever it was made for
            discard(folder)
        if not folder.exists():
            create(folder, setup, excitation, played, sample_rate_hz, about)
        check_setup(folder, setup)
        remove_stale(folder)  # of acquisitions that were killed
        session = LiveSession(folder, setup)
        session.about(finished=False)
        try:
            yield session
        finally:
            if is_empty(folder):
                discard(folder)
            else:
                session.about(finished=True)


def _table(folder: Path) -> list[Recording]:
    """Return the rows of the table. Raises DataError for a row that is wrong: it would be lost when
    the table is written."""
    rows, findings = read_recordings(folder)
    if findings:
        first = findings[0]
        raise DataError(folder / RECORDINGS_FILE, first.problem, first.fix)
    for row in rows:
        number = row.labels.get(ATTEMPT, "")
        if row.labels.get(PLANNED) and not number.isdecimal():
            problem = f"{row.recording_id}: {ATTEMPT} = {number!r}"
            raise DataError(folder / RECORDINGS_FILE, problem, "write the number of the attempt")
    return rows
