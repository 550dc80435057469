"""The project that is tortured: a few real recordings, and what people do with them.

Each thing that is done is a function of the project's folder, run in a process of its own by way of
`forked.py`; `jobs` is the code of the workflow's jobs without Snakemake, which needs no start-up.
"""

from __future__ import annotations

import csv
import functools
import hashlib
import http.server
import json
import os
import re
import shutil
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import numpy as np
import yaml

from ajgdata.acquire.source import Grasp, Take
from ajgdata.acquire.writer import acquire_session
from ajgdata.cli import main as command
from ajgdata.experiments import asked_of
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.merge import merge
from ajgdata.pipeline.train import train_model
from ajgdata.store.audio import read_audio, write_pcm24
from ajgdata.store.sessions import list_sessions, read_dataset
from ajgdata.types import AudioSettings

RATE_HZ = 44_100
MATERIALS, TAKES = ("Ceramic", "Marble", "Wood"), 4
#: Below this folder of the recordings that people may have: see `source_folder`.
REAL = Path("knock_material/processed/train")
PATTERN = r"(?P<material>[^/]+)/(?P<sample>\d+)\.wav"
DECLARATION = {
    "name": "knock",
    "description": "Knocks on materials, to be tortured.",
    "licence": "CC0-1.0",
    "targets": {"material": {"kind": "classification"}},
    "tasks": {
        "material": {
            "target": "material",
            "folds": 2,
            "models": ["knn"],
        }
    },
}
#: Not compared: what is measured, told, or kept to be quick.
ASIDE = (
    *("results/logs/", "results/benchmarks/", "results/report/", ".snakemake/", ".cache/"),
    ".ajgdata/fetched/",
)
ASIDE_NAMES = ("metrics.json", "settings.yaml")
TEMPORARY = (".tmp", ".new", ".old", ".empty", ".part")


def source_folder(given: Path | None, made: Path) -> tuple[Path, str]:
    """Return a folder `<material>/<number>.wav` of a few recordings, and what they are: `recorded`,
    copied from below `given`, else `simulated`."""
    real = given / REAL if given else None
    kind = "recorded" if real and real.is_dir() else "simulated"
    generator = np.random.default_rng(0)
    time = np.arange(RATE_HZ) / RATE_HZ
    for number, material in enumerate(MATERIALS):
        (made / material).mkdir(parents=True)
        files = sorted((real / material).glob("*.wav"))[:TAKES] if kind == "recorded" else []
        for take in range(TAKES):
            target = made / material / f"{take}.wav"
            if files:
                shutil.copyfile(files[take], target)
                continue
            ring = np.sin(2 * np.pi * 700 * (number + 1) * time) * np.exp(-20 * time)
            noise = generator.normal(0, 0.01, len(time))
            write_pcm24(target, 0.5 * ring + noise, RATE_HZ)
    return made, kind


def declare(root: Path) -> Path:
    """An empty project in which the data set is declared."""
    path = Paths(root).dataset("knock")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(DECLARATION, sort_keys=False))
    (root / "settings.yaml").write_text(
        yaml.safe_dump({"pages": [], "publish": [], "quick": True, "datasets": ["knock"]})
    )
    return root


def said_by(*words: str) -> None:
    """Run the command `ajgdata` in this process."""
    sys.argv = ["ajgdata", *words]
    command()


def told(function) -> None:
    """Call a function that is no command; what is wrong is said as by commands."""
    sys.modules["ajgdata.cli.main"].app = function
    command()


class Replay:
    """A source whose grasps sound as the recordings of a folder do."""

    kind, sample_rate_hz = "soundcard", RATE_HZ

    def excitation(self):
        return None

    def take(self, grasp, sample):
        samples = read_audio(Path(grasp.setup["file"]), AudioSettings(channel="mean")).samples
        return Take(np.clip(samples, -1, 1))

    def describe(self):
        return {"gripper": "bench"}


def acquire(source: Path, root: Path) -> None:
    """Record a session of the folder's sounds."""
    grasps = [
        Grasp(f"{m}_{n}", m, 1, {"material": m}, {"file": str(source / m / f"{n}.wav")}, "")
        for m in MATERIALS
        for n in range(TAKES)
    ]
    told(lambda: acquire_session(Paths(root).session("knock", "bench"), Replay(), grasps))


def bring(source: Path, root: Path) -> None:
    """Import the folder."""
    said_by(
        *("import", str(source), "--dataset", "knock"),
        *("--pattern", PATTERN, "--target", "material"),
    )


def jobs(root: Path) -> None:
    """Features, store, model, one experiment and all results: what the workflow's jobs do."""
    told(functools.partial(_jobs, Paths(root)))


def _jobs(paths: Paths) -> None:
    spec = read_dataset(paths, "knock")
    sessions = list_sessions(paths, "knock")
    for session in sessions:
        extract_features(
            folder=paths.session("knock", session),
            audio=spec.audio,
            features=spec.features,
            code="",
            shard=paths.shard("knock", session),
            findings=paths.shard_findings("knock", session),
            labels=paths.shard_labels("knock", session),
        )
    merge(
        dataset="knock",
        shards=[paths.shard("knock", s) for s in sessions],
        labels=[paths.shard_labels("knock", s) for s in sessions],
        findings=[paths.shard_findings("knock", s) for s in sessions],
        targets=spec.targets,
        store=paths.features("knock"),
        quarantine=paths.quarantine("knock"),
    )
    train_model(
        paths.features("knock"),
        **spec.training("material"),
        model="knn",
        seed=0,
        folder=paths.model("knock", "material", "knn"),
    )
    asked = next(a for a in asked_of(spec, "material") if a.experiment.name == "cross_validation")
    kind = asked.kinds[0]
    run_experiment(
        paths.features("knock"),
        kind=kind,
        dataset="knock",
        task="material",
        settings=asked.job_settings(kind),
        split=spec.task_settings("material"),
        others=[],
        audio=spec.audio,
        features=spec.features,
        paths=paths,
        seed=0,
        tables=paths.experiment("knock", "material", kind),
        cost=paths.experiment_cost("knock", "material", kind),
    )
    collect(
        paths,
        [("knock", "material", kind)],
        document=paths.all_metrics,
        table=paths.metrics_table,
        predictions=paths.predictions,
    )


def publish(root: Path) -> None:
    """Publish it."""
    said_by("publish", "knock")


def fetch(address: str, root: Path) -> None:
    """Fetch it from a server."""
    said_by("fetch", address)


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Yield the web address of a folder."""
    handler = functools.partial(_Quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


def files_of(root: Path) -> dict[str, Path]:
    """Every file by its name below `root`, through linked folders, too."""
    found = {}
    for folder, _, names in os.walk(root, followlinks=True):
        for name in names:
            path = Path(folder) / name
            found[path.relative_to(root).as_posix()] = path
    return found


def state_of(root: Path) -> dict[str, str]:
    """The hash of every file that must be the same each time; of metrics all but what is
    measured."""
    found = {}
    for name, path in files_of(root).items():
        own = path.name
        if name.startswith(ASIDE) or own in ASIDE_NAMES or own.endswith((".cost.json", ".lock")):
            continue
        if any(part.endswith(".tmp") for part in Path(name).parts):  # of a killed process
            continue
        found[name] = digest_of(path)
    return found


def digest_of(path: Path) -> str:
    """The hash of what a file says: not of what is measured, nor of clock and places in memory,
    which skops writes into models."""
    content = path.read_bytes()
    if path.name == "metrics.csv":
        content = b"".join(r for r in content.splitlines(True) if b",measured," not in r)
    elif path.suffix == ".skops":
        content = _estimator(path)
    return hashlib.sha256(content).hexdigest()


def _estimator(path: Path) -> bytes:
    with ZipFile(path) as held:
        schema = re.sub(r'"__id__": \d+', "", held.read("schema.json").decode())
        names = dict.fromkeys(re.findall(r"\d+\.npy", schema))
        for number, name in enumerate(names):
            schema = schema.replace(name, f"array {number}")
        return b"".join([schema.encode(), *map(held.read, names)])


def differing(root: Path, whole: dict[str, str]) -> list[str]:
    """Files that are not those of the state `whole`."""
    now = state_of(root)
    return [f"{n} differs" for n in sorted({*now, *whole}) if now.get(n) != whole.get(n)]


def leftovers(root: Path) -> list[str]:
    """Temporary files and folders that are still there."""
    return sorted(
        path.relative_to(root).as_posix()
        for path in root.rglob(".*")
        if path.name.endswith(TEMPORARY) and ".snakemake" not in path.parts
    )


def torn(root: Path, whole: dict[str, str]) -> list[str]:
    """Files under their final name that are not whole: audio, stores, models and archives have the
    bytes of the state `whole`; tables and documents can be read."""
    found = []
    for name, path in files_of(root).items():
        hidden = any(part[0] == "." for part in Path(name).parts)
        if hidden or name.startswith(ASIDE) or not name.startswith(("data/", "results/")):
            continue
        if not _is_whole(path, whole.get(name)):
            found.append(name)
    return found


def _is_whole(path: Path, digest: str | None) -> bool:
    content = path.read_bytes()
    try:
        if path.suffix in (".wav", ".nc", ".skops", ".safetensors", ".zip", ".png"):
            return digest is None or digest_of(path) == digest
        if path.suffix == ".json":
            json.loads(content)
        elif path.suffix == ".yaml":
            return bool(yaml.safe_load(content))
        elif path.suffix == ".csv":
            rows = list(csv.reader(content.decode().splitlines()))
            return content.endswith(b"\n") and len({len(row) for row in rows}) == 1
    except (ValueError, KeyError, BadZipFile, yaml.YAMLError):
        return False
    return True
