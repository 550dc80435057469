"""Import one long recording of 20 taps, whose label track Audacity exported, and load the taps.

The command for the same is `ajgdata import FOLDER --dataset mine --segments track --period 1`.
"""

import tempfile
from pathlib import Path

import numpy as np
import soundfile

import ajgdata
from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.types import ImportSettings, SegmentSettings

RATE_HZ = 44_100
project = Path(tempfile.mkdtemp())
folder = project / "finger_029"
folder.mkdir()
labels = ["none", "tip", "none", "base"]  # each for five seconds, with one tap per second
pitches_hz = {"none": 800, "tip": 1500, "base": 2400}
time_s = np.arange(RATE_HZ) / RATE_HZ
taps = [
    0.5 * np.exp(-8 * time_s) * np.sin(2 * np.pi * pitches_hz[label] * time_s)
    for label in labels
    for _ in range(5)
]
soundfile.write(folder / "long.wav", np.concatenate(taps), RATE_HZ, subtype="PCM_24")
track = [f"{5 * place:.6f}\t{5 * place + 5:.6f}\t{label}" for place, label in enumerate(labels)]
(folder / "long.txt").write_text("\n".join(track))

(project / "datasets").mkdir()
segments = SegmentSettings(labels="track", period_s=1)  # --segments track --period 1
import_folder(Paths(project), "mine", folder, settings=ImportSettings(segments=segments))

recordings = ajgdata.load_recordings("mine", project)
counts = recordings.label.to_series().value_counts().to_dict()
seventh = recordings.isel(recording=6)
grasps = len(np.unique(recordings.grasp_id))
print(f"{counts} in {grasps} grasps")
print(f"{seventh.recording.item()}: {seventh.label.item()}, {seventh.start_s.item()} s in the file")
