"""Find one wrong label among 60 recordings, correct it, and take the correction back.

The commands for the same are `ajgdata review mine` and `ajgdata label mine RECORDING …`.
"""

import tempfile
from pathlib import Path

import numpy as np
import soundfile

from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder
from ajgdata.pipeline.labelling import change_recording, recording_state
from ajgdata.pipeline.review import review_list

RATE_HZ = 44_100
MODES_HZ = {"ball": (700, 1900, 3400), "bar": (850, 2200, 3900), "cube": (1000, 2500, 4400)}
WRONG = 17  # a ball that is named cube

project = Path(tempfile.mkdtemp())
(project / "datasets").mkdir()
(project / "takes").mkdir()
random = np.random.default_rng(0)
time_s = np.arange(RATE_HZ // 5) / RATE_HZ
for number in range(60):
    label = list(MODES_HZ)[number // 20]
    pose = 1 + 0.02 * random.normal()
    ringing = sum(np.sin(2 * np.pi * pose * hz * time_s) for hz in MODES_HZ[label])
    samples = 0.1 * np.exp(-10 * time_s) * ringing + 0.01 * random.normal(size=len(time_s))
    name = "cube" if number == WRONG else label
    soundfile.write(project / "takes" / f"{number + 1}_{name}.wav", samples, RATE_HZ)

paths = Paths(project)
import_folder(paths, "mine", project / "takes", settings=None)
first = review_list(paths, "mine").items[0]
print(f"{first.recording} {first.label}: {'; '.join(first.reasons)}")

seen = recording_state(paths, "mine", first.recording)
change = change_recording(
    paths,
    "mine",
    first.recording,
    "label",
    column="label",
    value="ball",
    reason="misread",
    version=seen.version,  # refused if somebody else changed the recording meanwhile
)
print(f"{change.column}: {change.old} -> {change.new} ({change.reason})")
undo = change_recording(paths, "mine", first.recording, "undo")
print(f"undo: {undo.old} -> {undo.new}")
