"""What one prediction costs: the package, torch alone, ONNX Runtime, NumPy alone; side by side.

    python benchmarks/predict.py [--rounds 3] [--calls 300]

A CNN is trained on random spectra of 16 classes, exported, and asked of one-second recordings, one
at a time, one thread, each route in a process of its own. The routes take turns, so that a busy
machine slows all alike. *Start* is the time from starting the interpreter to the first answer, the
least of all rounds; *answer* the time of each later one.
`torch` is the network on the package's spectrum, without checks, calibration or novelty, which the
other three have. Linux only: memory is read from /proc.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from ajgdata.paths import Paths
from ajgdata.pipeline.export_model import export_model
from ajgdata.pipeline.train import train_model
from ajgdata.store.features import Shard, text_column, write_store
from ajgdata.types import AudioSettings, FeatureSettings

BINS, CLASSES, GRASPS, RECORDINGS = 1025, 16, 6, 24
RATE_HZ = 44_100
#: Run in a fresh interpreter: each defines `answer(samples)`, the class of one recording.
ROUTES = {
    "package": """
from pathlib import Path
from ajgdata.loading import read_predictor
predictor = read_predictor(Path(model), "d", "t")
answer = lambda samples: predictor.predict(samples, rate).value
""",
    "torch": """
import json
import torch
from safetensors.torch import load_file
from ajgdata.features.spectrum import spectrum
from ajgdata.models.network import SpectrumCnn
from ajgdata.types import FeatureSettings
torch.set_num_threads(1)
with open(model + "/model.json") as file:
    about = json.load(file)
how, settings = about["network"]["params"], FeatureSettings(**about["features"])
sizes = how["channels"], how["kernel"], how["stride"], how["dropout"]
network = SpectrumCnn(len(about["frequency_hz"]), len(about["classes"]), *sizes).eval()
network.load_state_dict(load_file(model + "/model.safetensors"))
def answer(samples):
    with torch.inference_mode():
        scores = network(torch.from_numpy(spectrum(samples, rate, settings))[None])
        return about["classes"][int(scores.softmax(1).argmax())]
""",
    "onnx": """
import json
import onnxruntime
options = onnxruntime.SessionOptions()
options.intra_op_num_threads = 1
session = onnxruntime.InferenceSession(onnx, options, providers=["CPUExecutionProvider"])
classes = json.loads(session.get_modelmeta().custom_metadata_map["ajgdata"])["classes"]
place = [output.name for output in session.get_outputs()].index("class")
answer = lambda samples: classes[session.run(None, {"waveform": samples[None]})[place][0]]
""",
    "numpy": """
sys.path.insert(0, folder)
import ajgdata_numpy
exported = ajgdata_numpy.load(npz)
answer = lambda samples: exported.predict(samples, rate)["value"]
""",
}
FRAME = r"""
import sys, time
started, model, folder, onnx, npz, sounds, calls = sys.argv[1:]
rate = {rate}
import numpy as np
{route}
recordings = np.load(sounds)
said = [answer(recordings[0])]
start_s, cpu_s = time.time() - float(started), time.process_time()
said += [answer(one) for one in recordings[1:]]
times = []
for n in range(int(calls)):
    begin = time.perf_counter()
    answer(recordings[n % len(recordings)])
    times.append(time.perf_counter() - begin)
import json, re
with open("/proc/self/status") as file:  # ru_maxrss would begin with the parent's
    peak = int(re.search(r"VmHWM:\s+(\d+)", file.read())[1]) / 1024
print(json.dumps(dict(said=said, start_s=start_s, cpu_s=cpu_s, times=times, peak_mib=peak)))
"""


def made(root: Path) -> tuple[str, str, str, str, str]:
    """Train and export; return the places that the routes are told."""
    generator = np.random.default_rng(0)
    frequency = np.arange(BINS) * RATE_HZ / 2048
    peaks = np.abs(generator.standard_normal((CLASSES, BINS))) ** 3
    rows = np.repeat(np.arange(CLASSES), GRASPS)
    feature = peaks[rows] * np.exp(0.2 * generator.standard_normal((len(rows), BINS)))
    feature = (feature / feature.sum(axis=1, keepdims=True)).astype(np.float32)
    audio = AudioSettings(sample_rate_hz=RATE_HZ).model_dump(mode="json")
    settings = {"audio": audio, "features": FeatureSettings().model_dump(mode="json")}
    columns = {
        "recording": text_column([f"s/{n}" for n in range(len(rows))]),
        "grasp_id": text_column([f"g{n}" for n in range(len(rows))]),
        "object": text_column([f"thing {n}" for n in rows]),
    }
    paths = Paths(root)
    shard = Shard(feature, frequency, columns, {"settings": json.dumps(settings)})
    write_store(paths.features("d"), shard, {"units": "1"})
    folder = paths.model("d", "t", "cnn")
    about = {"target": "object", "kind": "classification", "unit": "", "groups": "grasp_id"}
    train_model(paths.features("d"), **about, model="cnn", seed=0, folder=folder)
    out = paths.exported
    (onnx,) = export_model(paths, "d", "t", "cnn", to="onnx", folder=out)
    npz, _ = export_model(paths, "d", "t", "cnn", to="numpy", folder=out)
    sounds = root / "sounds.npy"
    spectra = peaks[generator.integers(0, CLASSES, RECORDINGS)]
    phases = np.exp(2j * np.pi * generator.random((RECORDINGS, RATE_HZ // 2 + 1)))
    every = np.linspace(0, RATE_HZ / 2, phases.shape[1])
    loud = np.array([np.interp(every, frequency, one) for one in spectra])
    waves = np.fft.irfft(loud * phases, RATE_HZ)
    waves = (0.5 * waves / np.abs(waves).max(axis=1, keepdims=True)).astype(np.float32)
    np.save(sounds, waves)
    return str(folder), str(out), str(onnx), str(npz), str(sounds)


def measured(route: str, places: tuple[str, ...], calls: int) -> dict:
    """Run one route in a process of its own."""
    code = FRAME.format(rate=RATE_HZ, route=ROUTES[route])
    command = [sys.executable, "-c", code, repr(time.time()), *places, str(calls)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return json.loads(done.stdout)


def main(
    rounds: Annotated[int, typer.Option(help="processes of each route")] = 3,
    calls: Annotated[int, typer.Option(help="answers that are timed in each")] = 300,
) -> None:
    """Print times, memory and ratios to the package."""
    with tempfile.TemporaryDirectory() as temporary:
        places = made(Path(temporary))
        runs = {route: [] for route in ROUTES}
        for _ in range(rounds):
            for route in ROUTES:
                runs[route].append(measured(route, places, calls))
        sizes = {"onnx": Path(places[2]).stat().st_size, "numpy": Path(places[3]).stat().st_size}
    if len({tuple(one["said"]) for made_ in runs.values() for one in made_}) != 1:
        raise SystemExit("the routes do not say the same: nothing is compared")
    figures = {route: summary(made_) for route, made_ in runs.items()}
    table = Table(
        "route", "answer, ms", "99 %, ms", "start, s", "CPU, s", "memory, MiB", "of package"
    )
    for route, one in figures.items():
        of = [f"{a / b:.2g}" for a, b in zip(one, figures["package"], strict=True)]
        shown = [f"{1e3 * one[0]:.2f}", f"{1e3 * one[1]:.2f}", f"{one[2]:.2f}", f"{one[3]:.2f}"]
        table.add_row(route, *shown, f"{one[4]:.0f}", f"{of[0]} / {of[2]} / {of[4]}")
    console = Console()
    console.print(table)
    console.print("of package: answer / start / memory. " + str(sizes) + " bytes")


def summary(runs: list[dict]) -> tuple[float, float, float, float, float]:
    """Median and 99 % of an answer, start, its CPU time (s), and peak memory (MiB)."""
    times = np.concatenate([one["times"] for one in runs])
    start = min(one["start_s"] for one in runs)
    cpu = min(one["cpu_s"] for one in runs)
    memory = max(one["peak_mib"] for one in runs)
    return float(np.median(times)), float(np.quantile(times, 0.99)), start, cpu, memory


if __name__ == "__main__":
    typer.run(main)
