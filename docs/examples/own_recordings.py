"""Add recordings of one's own from Python, look at their samples, and make their spectra.

The command for the same is `ajgdata import FOLDER --dataset mine`.
"""

import tempfile
from pathlib import Path

import numpy as np
import soundfile

import ajgdata
from ajgdata.features.spectrum import frequencies_hz, spectrum
from ajgdata.paths import Paths
from ajgdata.pipeline.importing import import_folder

RATE_HZ = 48_000
project = Path(tempfile.mkdtemp())
takes = project / "takes"
takes.mkdir()
time_s = np.arange(RATE_HZ) / RATE_HZ
for number, (label, ring_hz) in enumerate({"wood": 1500, "metal": 6000}.items(), start=1):
    ringing = 0.5 * np.exp(-5 * time_s) * np.sin(2 * np.pi * ring_hz * time_s)
    with soundfile.SoundFile(takes / f"{number}_{label}.wav", "w", RATE_HZ, 1, "PCM_24") as file:
        file.comment = "simulated"  # real recordings need no comment
        file.write(ringing)

(project / "datasets").mkdir()
import_folder(Paths(project), "mine", takes, settings=None)

recordings = ajgdata.load_recordings("mine", project)  # opens no file yet
first_tenth = recordings.waveform.sel(time=slice(0, 0.1))
settings = ajgdata.load_dataset("mine", project).spec.features
rings_hz = {}
for recording in recordings.recording:
    samples = recordings.waveform.sel(recording=recording).values
    peak = np.argmax(spectrum(samples, RATE_HZ, settings))
    rings_hz[recording.label.item()] = float(frequencies_hz(RATE_HZ, settings)[peak])
print(rings_hz, f"in {recordings.sizes['recording']} recordings")
