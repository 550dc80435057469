"""Recordings of sines in noise, in several sessions."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ajgdata.paths import Paths
from ajgdata.store.audio import write_pcm24
from ajgdata.store.sessions import write_session
from ajgdata.types import Recording, Session

RATE_HZ = 44_100
#: What runs are asked for: all, and the features of one session.
TARGETS = ("results/report/index.html", "results/metrics.csv")
SHARD = "results/features/tones/day1.nc"


def make_tones(paths: Paths, sessions: Sequence[str]) -> None:
    """Record six tones of a fifth of a second in each session of the data set `tones`."""
    for number, session in enumerate(sessions):
        folder = paths.session("tones", session)
        recordings = []
        for index in range(6):
            file = f"audio/{index}.wav"
            _write_tone(
                folder / file, (3000 if index % 2 else 300) + 40 * index, 10 * number + index
            )
            label = {"pitch": "high" if index % 2 else "low"}
            one = Recording(recording_id=str(index), file=file, grasp_id=str(index), labels=label)
            recordings.append(one)
        write_session(folder, Session(session_id=session, source="import"), recordings)


def _write_tone(path: Path, hz: float, seed: int) -> None:
    time_s = np.arange(RATE_HZ // 5) / RATE_HZ
    noise = np.random.default_rng(seed).normal(0, 0.01, len(time_s))
    write_pcm24(path, 0.5 * np.sin(2 * np.pi * hz * time_s) + noise, RATE_HZ)
