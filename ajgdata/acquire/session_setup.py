"""The setup of a real session: what it is made with, held by one process, and the same for ever."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.acquire.card import DEVICE
from ajgdata.paths import AUDIO_FOLDER, EXCITATION_FILE, SESSION_FILE
from ajgdata.store.audio import file_sha256, write_pcm24
from ajgdata.store.files import alone, replacing_folder
from ajgdata.store.provenance import software
from ajgdata.store.sessions import read_recordings, read_session, write_session
from ajgdata.types import Acquisition, DataError, Excitation, ExcitationSpec, Session


def setup_digest(setup: Mapping[str, Any]) -> str:
    """Return what tells setups apart in the table."""
    return hashlib.sha256(json.dumps(setup, sort_keys=True).encode()).hexdigest()


def recording_alone(folder: Path) -> AbstractContextManager[None]:
    """Return what holds the session's lock. Raises DataError if another process records into it."""
    fix = "wait for that one, or record into another session"
    return alone(folder, "recording into this session", fix)


def create(
    folder: Path,
    setup: Mapping[str, Any],
    excitation: np.ndarray,
    played: ExcitationSpec,
    sample_rate_hz: int,
    about: Mapping[str, Any],
) -> None:
    """Make a session that holds nothing yet, in one step.

    A session of the virtual gripper has the source `virtual`.
    """
    with replacing_folder(folder) as new:
        (new / AUDIO_FOLDER).mkdir()
        write_pcm24(new / EXCITATION_FILE, excitation, sample_rate_hz)
        digest = file_sha256(new / EXCITATION_FILE)
        peak = float(np.abs(excitation).max())
        session = Session(
            session_id=folder.name,
            source="virtual" if about.get("device") == DEVICE else "soundcard",
            sample_rate_hz=sample_rate_hz,
            excitation=Excitation(
                file=EXCITATION_FILE,
                sha256=digest,
                description=played.description,
                settings=played.model_dump(mode="json"),
            ),
            software=f"ajgdata {software()['ajgdata_version']}",
            acquisition=Acquisition(
                finished=False, setup=dict(setup), level_dbfs=round(20 * math.log10(peak), 2)
            ),
            **about,
        )
        write_session(new, session, [])


def is_empty(folder: Path) -> bool:
    """Return True for a session of the sound card that never got a recording."""
    if not (folder / SESSION_FILE).is_file() or any((folder / AUDIO_FOLDER).glob("[!.]*")):
        return False
    return read_session(folder).acquisition is not None and not read_recordings(folder)[0]


def discard(folder: Path) -> None:
    """Remove a session in one step, as others see it."""
    hidden = folder.with_name(f".{folder.name}.empty")
    shutil.rmtree(hidden, ignore_errors=True)  # left by a killed process
    folder.rename(hidden)
    shutil.rmtree(hidden)


def check_setup(folder: Path, setup: Mapping[str, Any]) -> None:
    """Raise DataError, with what differs, if a session was recorded with another setup."""
    session = read_session(folder)
    known = session.acquisition
    fix = "record into another --session"
    if known is None:
        raise DataError(folder, "was not recorded by `ajgdata acquire --source soundcard`", fix)
    now = json.loads(json.dumps(setup))
    if differing := [key for key in now if now[key] != known.setup.get(key)]:
        problem = f"was recorded with another setup: {', '.join(differing)}"
        raise DataError(folder, problem, f"restore that, or {fix}")
    if session.excitation is not None:
        played = folder / session.excitation.file
        if file_sha256(played) != session.excitation.sha256:
            raise DataError(played, "is not what was played (sha256 differs)", "restore it")
