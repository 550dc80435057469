"""The recordings of `benchmarks/scale.py`, and their data set: a test of scale, no evidence."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ajgdata.paths import Paths

NAME = "scale"
SAMPLES, GRASPS = 50, 10  # of a grasp, of a session
THINGS = 5  # names that the responses have in turn
RATE_HZ = 44_100
PATTERN = (
    r"(?P<session>s\d+)/(?P<grasp>g\d+)_(?P<object>\w+)_(?P<level_db>-?[\d.]+)dB_"
    r"(?P<sample>\d+)\.wav"
)
#: rms of the noise of a take, full scale 1.
NOISE = 3e-4
#: A small one: four networks instead of ninety.
EMBEDDING = {
    "supervision": "which responses are the same",
    "target": "object",
    "folds": 2,
    "inits": 1,
    "dimensions": [2, 8],
}


def kept_responses(folder: Path, count: int) -> list[Any]:
    """Return up to `count` impulse responses that are kept in a folder; a few new ones of a coarse
    grid if there is none."""
    from ajgdata import gripper
    from ajgdata.store.responses import read_response

    files = sorted(folder.rglob("*.npz"))
    found = [read_response(path) for path in files[:: max(1, len(files) // count)][:count]]
    if found := [one for one in found if one is not None]:
        return found
    scenes = [
        gripper.Scene.model_validate(
            {
                "object": {"kind": "cube", "edge_mm": edge},
                "numerics": {"dx_mm": 6, "max_time_s": 0.006},
            }
        )
        for edge in (12, 18, 24, 30)
    ]
    return [gripper.simulate(scene) for scene in scenes]


def make(folder: Path, responses: Sequence[Any], first: int, count: int, take_s: float) -> None:
    """Write `count` recordings, of the grasps from number `first` on."""
    from ajgdata import gripper
    from ajgdata.acquire.excitation import excitation_samples
    from ajgdata.store.audio import pcm24_bytes
    from ajgdata.types import DEFAULT_EXCITATION

    sweep = excitation_samples(DEFAULT_EXCITATION, RATE_HZ)
    silent = gripper.SignalChain(noise_db_spl=None)
    frames = round(take_s * RATE_HZ)
    for grasp in range(first, first + -(-count // SAMPLES)):
        clean = gripper.record(responses[grasp % len(responses)], sweep, silent).samples[:frames]
        level = 20 * np.log10(np.sqrt(np.mean(np.square(clean, dtype=np.float64))))
        session = folder / f"s{grasp // GRASPS:04d}"
        session.mkdir(parents=True, exist_ok=True)
        thing = grasp % len(responses) % THINGS
        stem = f"g{grasp:05d}_r{thing}_{level:.2f}dB"
        for sample in range(1, 1 + min(SAMPLES, count - (grasp - first) * SAMPLES)):
            noise = np.random.default_rng([grasp, sample]).standard_normal(frames, np.float32)
            content = pcm24_bytes(clean + NOISE * noise, RATE_HZ)
            (session / f"{stem}_{sample:02d}.wav").write_bytes(content)


def declared(project: Paths, models: Sequence[str], folder: Path) -> None:
    """Declare the data set."""
    from ajgdata.pipeline.importing import common_audio
    from ajgdata.store.sessions import write_dataset
    from ajgdata.types import DatasetSpec

    spec = DatasetSpec.model_validate(
        {
            "name": NAME,
            "title": "Scale test: repeated impulse responses with noise, no evidence of anything",
            "licence": "CC0-1.0",
            "audio": common_audio([next(folder.rglob("*.wav"))]).model_dump(),
            "targets": {
                "level_db": {"kind": "regression", "unit": "dB"},
                "object": {"kind": "classification"},
            },
            "tasks": {"level": {"target": "level_db", "folds": 5, "models": list(models)}},
            "embeddings": {"things": EMBEDDING} if models else {},
            "imports": {"pattern": PATTERN},
        }
    )
    write_dataset(project, spec)


def relabel(project: Paths) -> None:
    """Correct the label of one recording, as a person does in recordings.csv."""
    from ajgdata.store.sessions import read_recordings, write_recordings

    folder = max(project.sessions(NAME).iterdir())
    rows, _ = read_recordings(folder)
    labels = {**rows[0].labels, "level_db": "-1.25"}
    write_recordings(folder, [rows[0].model_copy(update={"labels": labels}), *rows[1:]])
