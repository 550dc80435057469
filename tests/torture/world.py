"""A project of a few simulated recordings, the actions of its users, and its state in hashes."""

from __future__ import annotations

import csv
import functools
import hashlib
import http.server
import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from zipfile import BadZipFile, ZipFile

import numpy as np
import yaml

from ajgdata.cli import main
from ajgdata.paths import Paths
from ajgdata.store.audio import write_pcm24

RATE_HZ = 44_100
MATERIALS = ("Ceramic", "Marble", "Wood")
TAKES = 4
SNAKEFILE = Path(__file__).resolve().parents[2] / "workflow/Snakefile"
PATTERN = r"(?P<material>[^/]+)/(?P<clip>\d+)\.wav"
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
ASIDE_NAMES = ("settings.yaml",)
TEMPORARY = (".tmp", ".new", ".old", ".empty", ".part")


def source_folder(folder: Path) -> Path:
    """Return a folder `<material>/<number>.wav` of a few recordings."""
    generator = np.random.default_rng(0)
    time = np.arange(RATE_HZ) / RATE_HZ
    for number, material in enumerate(MATERIALS):
        (folder / material).mkdir(parents=True)
        for take in range(TAKES):
            ring = np.sin(2 * np.pi * 700 * (number + 1) * time) * np.exp(-20 * time)
            noise = generator.normal(0, 0.01, len(time))
            write_pcm24(folder / material / f"{take}.wav", 0.5 * ring + noise, RATE_HZ)
    return folder


def declare(root: Path) -> Path:
    """An empty project in which the data set is declared."""
    path = Paths(root).dataset("knock")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump(DECLARATION, sort_keys=False))
    (root / "settings.yaml").write_text(
        yaml.safe_dump({"pages": [], "publish": [], "quick": True, "datasets": ["knock"]})
    )
    return root


def run_command(*words: str) -> None:
    """Run the command `ajgdata` in this process."""
    sys.argv = ["ajgdata", *words]
    main()


def command(*words: object) -> int:
    """Run a program of the system; return its exit code."""
    return subprocess.run(list(map(str, words)), check=False, capture_output=True).returncode


def import_folder(source: Path, root: Path) -> None:
    """Import the folder."""
    run_command(
        *("import", str(source), "--dataset", "knock"),
        *("--pattern", PATTERN, "--target", "material"),
    )


def workflow(root: Path, *words: str) -> None:
    """Run the workflow, in place of this process."""
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(SNAKEFILE)]
    command += ["--directory", str(root), "--configfile", str(root / "settings.yaml")]
    command += ["--cores", "2"]
    os.execv(sys.executable, [*command, "results/metrics.csv", *words])


def publish(root: Path) -> None:
    """Publish it."""
    run_command("publish", "knock")


def fetch(address: str, root: Path) -> None:
    """Fetch it from a server."""
    run_command("fetch", address)


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
    files = {}
    for folder, _, names in os.walk(root, followlinks=True):
        for name in names:
            path = Path(folder) / name
            files[path.relative_to(root).as_posix()] = path
    return files


def state_of(root: Path) -> dict[str, str]:
    """The hash of every file that must be the same each time; of metrics all but what is
    measured."""
    digests = {}
    for name, path in files_of(root).items():
        own = path.name
        if (
            name.startswith(ASIDE)
            or own in ASIDE_NAMES
            or own.endswith((".cost.json", ".lock", ".holder"))
        ):
            continue
        if any(part.endswith(".tmp") for part in Path(name).parts):  # of a killed process
            continue
        digests[name] = digest_of(path)
    return digests


def digest_of(path: Path) -> str:
    """The hash of what a file says: not of what is measured, nor of clock and places in memory,
    which skops writes into models."""
    content = path.read_bytes()
    if path.name == "metrics.csv":
        content = b"".join(r for r in content.splitlines(True) if b",cost," not in r)
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
    names = []
    for name, path in files_of(root).items():
        hidden = any(part[0] == "." for part in Path(name).parts)
        if hidden or name.startswith(ASIDE) or not name.startswith(("data/", "results/")):
            continue
        if not _is_whole(path, whole.get(name)):
            names.append(name)
    return names


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
