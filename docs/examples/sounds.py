"""Write an own sound, and compare it with the sounds that ajgdata computes."""

from pathlib import Path

import numpy as np
import soundfile

from ajgdata.acquire.excitation import played_samples
from ajgdata.types import LinearSweep, LogSweep, MaximumLengthSequence, SoundFile, WhiteNoise

RATE_HZ = 44_100
time_s = np.arange(RATE_HZ // 10) / RATE_HZ
knock = 0.5 * np.sin(2 * np.pi * 800 * time_s) * np.exp(-time_s / 0.01)
Path("sounds").mkdir(exist_ok=True)
soundfile.write("sounds/knock.wav", knock, RATE_HZ, subtype="PCM_24")

sounds = {
    "log_sweep": LogSweep(),
    "linear_sweep": LinearSweep(),
    "mls": MaximumLengthSequence(),
    "noise": WhiteNoise(seed=1),
    "file": SoundFile(file="sounds/knock.wav", silence_before_s=0.15),
}
percent_below_1_khz = {}
for kind, declared in sounds.items():
    samples = played_samples(declared, RATE_HZ, project=Path())  # (n,), full scale ±1
    energy = np.abs(np.fft.rfft(samples)) ** 2
    frequency_hz = np.fft.rfftfreq(len(samples), 1 / RATE_HZ)
    percent_below_1_khz[kind] = 100 * energy[frequency_hz < 1_000].sum() / energy.sum()
    print(f"{kind:12} {percent_below_1_khz[kind]:5.1f} % of its energy is below 1 kHz")
