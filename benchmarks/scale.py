"""What 500, 5,000, 50,000 and 200,000 recordings cost, stage by stage.

    python benchmarks/scale.py [--size 500 --size 5000] [--take-s 1] [--out results/scale]

The recordings are a scale test and no evidence of anything: kept impulse responses (of the folder
`--responses`, else a few that are simulated now) x one sweep x seeds of noise, 50 recordings a
grasp, 10 grasps a session. Everything happens in a temporary project below `--work`, with the
recordings imported by reference, and is removed at the end. 200,000 recordings of one second are
27 GB, and published twice that again: take shorter ones (`--take-s 0.25`) and compare sizes of the
same length only.

Stages run in a process of their own, whose start-up and imports are not counted; commands are
measured as a person gives them, start-up and all. Processor time is that of all their processes,
memory the peak of the largest. `--opens` counts opened files of the project and the recordings
instead (needs strace, which slows what it watches).
"""

from __future__ import annotations

import json
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ajgdata.paths import Paths

NAME = "scale"
SAMPLES, GRASPS = 50, 10  # of a grasp, of a session
RATE_HZ = 44_100
PATTERN = (
    r"(?P<session>s\d+)/(?P<grasp>g\d+)_(?P<object>\w+)_(?P<level_db>-?[\d.]+)dB_"
    r"(?P<sample>\d+)\.wav"
)
#: rms of the noise of a take, full scale 1.
NOISE = 3e-4
AJGDATA = [sys.executable, "-c", "from ajgdata.cli import main; main()"]
HERE = Paths(Path(__file__).resolve().parents[1])
app = typer.Typer(add_completion=False)


def kept_responses(folder: Path, count: int) -> list[Any]:
    """Return up to `count` impulse responses that are kept in a folder; a few new ones of a coarse
    grid if there is none."""
    from ajgdata import gripper
    from ajgdata.store.responses import read_response

    files = sorted(folder.rglob("*.response"))
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
    from ajgdata.store.riff import encode_pcm24
    from ajgdata.types import DEFAULT_EXCITATION

    sweep = excitation_samples(DEFAULT_EXCITATION, RATE_HZ)
    silent = gripper.SignalChain(noise_db_spl=None)
    frames = round(take_s * RATE_HZ)
    for grasp in range(first, first + -(-count // SAMPLES)):
        clean = gripper.record(responses[grasp % len(responses)], sweep, silent).samples[:frames]
        level = 20 * np.log10(np.sqrt(np.mean(np.square(clean, dtype=np.float64))))
        session = folder / f"s{grasp // GRASPS:04d}"
        session.mkdir(parents=True, exist_ok=True)
        stem = f"g{grasp:05d}_r{grasp % 20:02d}_{level:.2f}dB"
        for sample in range(1, 1 + min(SAMPLES, count - (grasp - first) * SAMPLES)):
            noise = np.random.default_rng([grasp, sample]).standard_normal(frames, np.float32)
            content = encode_pcm24(clean + NOISE * noise, RATE_HZ)
            (session / f"{stem}_{sample:02d}.wav").write_bytes(content)


def declared(project: Paths, models: Sequence[str], folder: Path) -> None:
    """Declare the data set."""
    from ajgdata.pipeline.declare import common_audio
    from ajgdata.store.sessions import write_dataset
    from ajgdata.types import DatasetSpec

    spec = DatasetSpec.model_validate(
        {
            "name": NAME,
            "title": "Scale test: repeated impulse responses with noise, no evidence of anything",
            "licence": "CC0-1.0",
            "audio": common_audio([next(folder.rglob("*.wav"))]).model_dump(),
            "targets": {"level_db": {"kind": "regression", "unit": "dB"}},
            "tasks": {"level": {"target": "level_db", "folds": 5, "models": list(models)}},
            "imports": {"pattern": PATTERN},
        }
    )
    write_dataset(project, spec)


def stage_import(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.importing import import_folder

    return lambda: import_folder(project, NAME, folder, settings=None, copy=False)


def stage_validate(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.validate import validate_dataset

    return lambda: validate_dataset(project, NAME, lambda total: lambda: None)


def stage_manifest(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.store import manifest

    return lambda: manifest.refresh(project, NAME)


def stage_features(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.extract_features import extract_features
    from ajgdata.store.sessions import list_sessions, read_dataset

    spec = read_dataset(project, NAME)

    def extract() -> None:
        for session in list_sessions(project, NAME):
            extract_features(
                root=project.root,
                manifest=project.audio_manifest(NAME, session),
                audio=spec.audio,
                features=spec.features,
                code="",
                shard=project.shard(NAME, session),
                findings=project.shard_findings(NAME, session),
                cache=project.shard_cache(NAME, session),
            )

    return extract


def stage_merge(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.merge import merge
    from ajgdata.store.sessions import list_sessions, read_dataset

    spec, sessions = read_dataset(project, NAME), list_sessions(project, NAME)
    return lambda: merge(
        dataset=NAME,
        shards=[project.shard(NAME, one) for one in sessions],
        labels=[project.label_manifest(NAME, one) for one in sessions],
        findings=[project.shard_findings(NAME, one) for one in sessions],
        targets=spec.targets,
        store=project.merged(NAME),
        published=project.features(NAME),
        quarantine=project.quarantine(NAME),
    )


def stage_load(project: Paths, folder: Path) -> Callable[[], object]:
    import ajgdata
    import ajgdata.store.open_xarray

    def load() -> None:
        with ajgdata.load_features(NAME, project.root) as features:
            features.load()

    return load


def stage_publish(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.publish import publish

    return lambda: publish(project, NAME, project.published(NAME), date="2000-01-01")


def stage_fetch(project: Paths, folder: Path) -> Callable[[], object]:
    from ajgdata.pipeline.fetch import fetch

    return lambda: fetch(project, str(project.published(NAME)), name="fetched")


STAGES = {
    name.removeprefix("stage_"): function
    for name, function in list(globals().items())
    if name.startswith("stage_")
}


@app.command(hidden=True)
def stage(name: str, project: Path, folder: Path) -> None:
    """Run one stage and print what it took as JSON."""
    work = STAGES[name](Paths(project), folder)
    written, used, began = _written(), _cpu_s(resource.RUSAGE_SELF), time.perf_counter()
    sys.stdout.flush()
    output, sys.stdout = sys.stdout, sys.stderr
    work()
    sys.stdout = output
    print(
        json.dumps(
            {
                "wall_s": time.perf_counter() - began,
                "cpu_s": _cpu_s(resource.RUSAGE_SELF) - used,
                "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6,
                "written_mb": (_written() - written) / 1e6,
            }
        )
    )


def _written(pid: str = "self") -> int:
    """Return the bytes that a process, and its children that are gone, wrote."""
    lines = Path(f"/proc/{pid}/io").read_text().splitlines()
    return int(dict(line.split(": ") for line in lines)["write_bytes"])


def _cpu_s(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def run_stage(name: str, project: Paths, folder: Path, watch: Watch) -> dict[str, Any]:
    """Return what one stage took, in a process of its own."""
    line = [sys.executable, __file__, "stage", name, str(project.root), str(folder)]
    done = subprocess.run(watch.around(line), check=False, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{name}: exit code {done.returncode}\n{done.stderr}")
    found = {"stage": name, **json.loads(done.stdout.splitlines()[-1])}
    return watch.added(found)


def run_command(told: str, project: Paths, line: Sequence[str], watch: Watch) -> dict[str, Any]:
    """Return what a command took, all its processes together."""
    log = project.root / "log.txt"
    began = time.perf_counter()
    with log.open("wb") as stream:
        child = subprocess.Popen(
            watch.around(line), cwd=project.root, stdout=stream, stderr=subprocess.STDOUT
        )
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        wall = time.perf_counter() - began
        written = _written(str(child.pid))
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        sys.exit(f"{told}: exit code {child.returncode}\n{log.read_text()[-3000:]}")
    found = {
        "stage": told,
        "wall_s": wall,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss * 1024 / 1e6,
        "written_mb": written / 1e6,
    }
    return watch.added(found)


class Watch:
    """Counts the files below `root` that a command opens, if asked to, by strace."""

    def __init__(self, root: Path, *, asked: bool) -> None:
        self.root, self.asked, self.log = root, asked, root / "opened.txt"

    def around(self, line: Sequence[str]) -> list[str]:
        """Return the command, watched."""
        if not self.asked:
            return list(line)
        calls = "trace=open,openat,openat2"
        return ["strace", "-f", "--seccomp-bpf", "-qq", "-e", calls, "-o", str(self.log), *line]

    def added(self, found: dict[str, Any]) -> dict[str, Any]:
        """Return what was found, with the number of opened files."""
        if not self.asked:
            return found
        with self.log.open(errors="replace") as lines:
            opened = sum(str(self.root) in line and " = -1 " not in line for line in lines)
        return {"stage": found["stage"], "opened": opened}


def measured(
    root: Path, size: int, take_s: float, models: Sequence[str], kept: Path, *, opens: bool
) -> Iterator[dict[str, Any]]:
    """Yield what each stage took with `size` recordings; everything is below `root`."""
    folder, project = root / "recordings", Paths(root / "project")
    responses = kept_responses(kept, -(-size // SAMPLES))
    make(folder, responses, 0, size, take_s)
    project.datasets.mkdir(parents=True)
    shutil.copytree(HERE.root / "profiles", project.root / "profiles")
    declared(project, models, folder)
    watch = Watch(root, asked=opens)
    for name in ("import", "validate", "manifest", "features", "merge", "load"):
        yield run_stage(name, project, folder, watch)
    for name in ("publish", "fetch"):
        yield run_stage(name, project, folder, watch)
    shutil.rmtree(project.sessions("fetched").parent)
    shutil.rmtree(project.dataset("fetched").parent)
    shutil.rmtree(project.published(NAME))

    def command(told: str, *arguments: str) -> dict[str, Any]:
        return run_command(told, project, [*AJGDATA, *arguments], watch)

    features = str(project.features(NAME).relative_to(project.root))
    again = ("import", str(folder), "--dataset", NAME, "--reference")
    yield command("workflow: all features", "run", NAME, features)
    yield command("workflow: features again, nothing to do", "run", NAME, features)
    if models:
        yield command("workflow: models and report", "run", NAME)
        yield command("workflow: nothing to do", "run", NAME)
    yield command("status", "status", NAME)
    yield command("info", "info", NAME)
    yield command("import again, nothing new", *again)
    make(folder, responses, -(-size // SAMPLES), 1, take_s)
    yield command("import of one more", *again)
    yield command("one new recording, to the features", "run", NAME, features)
    relabel(project)
    yield command("one relabelled, to the features", "run", NAME, features)
    first = min(project.sessions(NAME).iterdir())
    if size > SAMPLES * GRASPS:
        shutil.rmtree(first)
        yield command("one session removed, to the features", "run", NAME, features)


def relabel(project: Paths) -> None:
    """Correct the label of one recording, as a person does in recordings.csv."""
    from ajgdata.store.sessions import read_recordings, write_recordings

    folder = max(project.sessions(NAME).iterdir())
    rows, _ = read_recordings(folder)
    labels = {**rows[0].labels, "level_db": "-1.25"}
    write_recordings(folder, [rows[0].model_copy(update={"labels": labels}), *rows[1:]])


def as_markdown(found: Sequence[dict[str, Any]], take_s: float) -> str:
    """Return the table of all stages, one row each, one column of figures a size."""
    sizes = list(dict.fromkeys(one["recordings"] for one in found))
    by_key = {(one["stage"], one["recordings"]): one for one in found}
    lines = [
        f"Recordings of {take_s:g} s. CPU seconds (ms a recording); peak memory, MB; written, MB.",
        "",
        "| stage | " + " | ".join(f"{size:,}" for size in sizes) + " |",
        "| --- |" + " --- |" * len(sizes),
    ]
    for name in dict.fromkeys(one["stage"] for one in found):
        cells = [_cell(by_key.get((name, size)), size) for size in sizes]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(one: dict[str, Any] | None, size: int) -> str:
    if one is None:
        return "–"
    if "opened" in one:
        return f"{one['opened']:,} opened"
    cpu = f"{one['cpu_s']:.1f} s ({1e3 * one['cpu_s'] / size:.2f} ms)"
    return f"{cpu}; {one['peak_mb']:.0f}; {one['written_mb']:.0f}"


@app.command()
def measure(
    size: Annotated[list[int], typer.Option(help="recordings (repeat)")] = [500, 5_000, 50_000],  # noqa: B006
    take_s: Annotated[float, typer.Option(help="length of a recording, s")] = 1.0,
    model: Annotated[list[str] | None, typer.Option(help="models of the report (repeat)")] = None,
    responses: Annotated[Path, typer.Option(help="folder of kept responses")] = HERE.responses,
    work: Annotated[Path | None, typer.Option(help="folder for what is made")] = None,
    out: Annotated[Path | None, typer.Option(help="also write OUT.json and OUT.md")] = None,
    opens: Annotated[bool, typer.Option("--opens", help="count opened files instead")] = False,
) -> None:
    """Measure each size, print the table and write it."""
    found: list[dict[str, Any]] = []
    for count in size:
        with tempfile.TemporaryDirectory(dir=work) as temporary:
            root = Path(temporary).resolve()
            for one in measured(root, count, take_s, model or [], responses, opens=opens):
                found.append({"recordings": count, **one})
                print(json.dumps(found[-1]), flush=True)
    table = as_markdown(found, take_s)
    print(table)
    if out:
        about = {"machine": platform.machine(), "cores": os.cpu_count(), "take_s": take_s}
        out.parent.mkdir(parents=True, exist_ok=True)
        out.with_suffix(".json").write_text(json.dumps({**about, "found": found}, indent=1))
        out.with_suffix(".md").write_text(table)


if __name__ == "__main__":
    app()
