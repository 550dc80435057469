"""Recorded tones, and the feature file of a data set, for tests of several folders."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ajgdata.experiments.requests import Request, requests_for
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.feature_file import build_feature_file
from ajgdata.store.audio import write_pcm24
from ajgdata.store.code_hash import features_code
from ajgdata.store.sessions import list_sessions, read_dataset, write_session
from ajgdata.types import Recording, Session

RATE_HZ = 44_100


def write_noisy_tone(path: Path, hz: float, seed: int) -> None:
    """Write a fifth of a second of a sine in noise."""
    time_s = np.arange(RATE_HZ // 5) / RATE_HZ
    noise = np.random.default_rng(seed).normal(0, 0.01, len(time_s))
    write_pcm24(path, 0.5 * np.sin(2 * np.pi * hz * time_s) + noise, RATE_HZ)


def record_tones(paths: Paths, sessions: Sequence[str], count: int = 8) -> None:
    """Record `count` low and high tones in each session of the data set `tones`."""
    for number, session in enumerate(sessions):
        folder = paths.session("tones", session)
        recordings = []
        for index in range(count):
            is_high = index % 2
            name = str(index)
            file = f"audio/{index}.wav"
            hz = (3000 if is_high else 300) + 40 * index
            write_noisy_tone(folder / file, hz, seed=100 * number + index)
            labels = {"pitch": "high" if is_high else "low"}
            recordings.append(Recording(recording_id=name, file=file, grasp_id=name, labels=labels))
        write_session(folder, Session(session_id=session, source="import"), recordings)


def make_features(paths: Paths, dataset: str) -> tuple[int, int]:
    """Compute the feature file of a data set; return how many recordings were computed and
    reused."""
    spec = read_dataset(paths, dataset)
    return build_feature_file(
        paths,
        dataset=dataset,
        sessions=list_sessions(paths, dataset),
        audio=spec.audio,
        features=spec.features,
        targets=spec.label_targets,
        code=features_code(spec.features),
        store=paths.features(dataset),
        quarantine=paths.quarantine(dataset),
        hashes=paths.session_hashes(dataset),
    )


def run_experiments(paths: Paths, dataset: str) -> list[Request]:
    """Run every experiment that the tasks of a data set request; return the requests."""
    spec = read_dataset(paths, dataset)
    requests = requests_for({dataset: spec}, [(dataset, task) for task in spec.tasks])
    for request in requests:
        for job in request.jobs:
            measured = request.of_job(job[-1])
            run_experiment(
                paths.features(dataset),
                dataset=dataset,
                task=request.task,
                experiment=request.experiment.name,
                parts=measured.part_names,
                settings=measured.job_settings(),
                task_settings=spec.task_settings(request.task),
                other_sets=request.other_sets,
                audio=spec.audio,
                features=spec.features,
                paths=paths,
                seed=0,
                tables=paths.experiment(*job),
                cost=paths.experiment_cost(*job),
            )
    return requests
