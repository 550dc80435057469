"""A small report of real measurements: recordings, features, experiments, pages."""

from pathlib import Path

import numpy as np
import yaml
from recorded import make_features, run_experiments
from sites import Site

from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.report import build_report
from ajgdata.store.audio import write_pcm24
from ajgdata.store.sessions import write_session
from ajgdata.types import Recording, Session

NAME = "tones"
RATE_HZ = 44_100
FRAMES = 2_000
CLASSES = ("low", "high")
GRASPS_PER_CLASS = 10
MODELS = ["linear_plain", "knn"]
DECLARATION = {
    "name": NAME,
    "title": "Tones of two pitches",
    "audio": {"sample_rate_hz": RATE_HZ},
    "features": {"window": 256, "hop": 128},
    "targets": {
        "pitch": {"kind": "classification"},
        "edge_mm": {"kind": "regression", "unit": "mm"},
    },
    "tasks": {
        "pitch": {
            "target": "pitch",
            "folds": 3,
            "models": MODELS,
            "experiments": {
                "learning_curve": {"groups": [3, 5], "repeats": 2, "models": MODELS},
                "sorting": {"models": MODELS},
            },
        },
        "edge": {
            "target": "edge_mm",
            "folds": 3,
            "models": MODELS,
            "experiments": {"conformal_intervals": {"models": ["linear_plain"]}},
        },
    },
}


def measured_site(folder: Path) -> Site:
    """Record tones below `folder`, measure every experiment on them, and write the report."""
    paths = Paths(folder)
    record(paths)
    make_features(paths, NAME)
    requests = run_experiments(paths, NAME)
    tasks = list(dict.fromkeys((NAME, request.task) for request in requests))
    collect(paths, datasets=[NAME], tasks=tasks)
    requested = [key for request in requests for key in request.keys]
    build_report(paths, datasets=[NAME], tasks=tasks, requested=requested)
    return Site(paths.report.parent)


def record(paths: Paths) -> None:
    """Write the data set: grasps of two classes, whose pitch follows the edge in mm."""
    paths.dataset(NAME).parent.mkdir(parents=True)
    paths.dataset(NAME).write_text(yaml.safe_dump(DECLARATION), encoding="utf-8")
    folder = paths.session(NAME, "s1")
    generator = np.random.default_rng(0)
    time_s = np.arange(FRAMES) / RATE_HZ
    recordings = []
    for number in range(GRASPS_PER_CLASS * len(CLASSES)):
        edge_mm = 10 + number
        pitch = CLASSES[number // GRASPS_PER_CLASS]
        tone = 0.4 * np.sin(2 * np.pi * 300 * edge_mm * time_s)
        file = f"audio/{number}.wav"
        write_pcm24(folder / file, tone + generator.normal(0, 0.02, FRAMES), RATE_HZ)
        labels = {"pitch": pitch, "edge_mm": str(edge_mm)}
        recordings.append(
            Recording(
                recording_id=str(number),
                file=file,
                labels=labels,
                grasp_id=f"g{number}",
                object=pitch,
            )
        )
    write_session(folder, Session(session_id="s1", source="import"), recordings)
