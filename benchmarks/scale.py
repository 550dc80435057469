"""What 500, 5,000, 50,000 and 200,000 recordings cost, stage by stage.

    python benchmarks/scale.py measure [--size 500 ...] [--take-s 0.25] [--most-s 1500]
    python benchmarks/scale.py docs results/scale.json

The recordings are a scale test and no evidence of anything: kept impulse responses (of the folder
`--responses`, else a few that are simulated now) x one sweep x seeds of noise, 50 recordings a
grasp, 10 grasps a session. Everything happens in a temporary project below `--work`, with the
recordings imported by reference, one size after the other, and is removed when it was measured.
200,000 recordings of 0.25 s are 4.4 GB, and published twice that again.

Stages run in a process of their own, whose start-up and imports are not counted; commands are
measured as a person gives them, start-up and all. Processor time is that of all their processes,
memory the peak of the largest. Jobs of a run say themselves what they took. What would begin after
`--most-s` is left out, and so is the end of a stage that takes longer than `--stage-s`. Opened
files of the project and the recordings are counted up to `--opens` recordings, in a second pass
(strace slows what it watches). `docs` puts the tables into docs/scale.md.
"""

from __future__ import annotations

import json
import os
import platform
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import scale_table
import typer

from ajgdata.paths import Paths
from ajgdata.store.benchmarks import read_benchmarks

NAME = "scale"
AJGDATA = [sys.executable, "-c", "from ajgdata.cli import main; main()"]
HERE = Paths(Path(__file__).resolve().parents[1])
STAGES = ("import", "validate", "features", "merge", "load")
MODELS = ("linear_plain", "ridge_plain", "knn", "svm", "forest", "boosting", "mlp", "cnn")
app = typer.Typer(add_completion=False)


@dataclass(frozen=True)
class Asked:
    """What to measure: `run` is the model of the workflow's run, of up to `most_run` recordings;
    `models` are trained alone up to `most_models`. `until` is when no further stage begins."""

    take_s: float
    responses: Path
    run: str
    most_run: int
    models: Sequence[str]
    most_models: int
    stage_s: float
    until: float


@app.command(hidden=True)
def stage(name: str, project: Path, folder: Path) -> None:
    """Run one stage and print what it took as JSON."""
    from scale_stages import work_of

    work = work_of(name, Paths(project), folder)
    written, used, began = _written(), _cpu_s(), time.perf_counter()
    sys.stdout.flush()
    output, sys.stdout = sys.stdout, sys.stderr
    work()
    sys.stdout = output
    took = {
        "wall_s": time.perf_counter() - began,
        "cpu_s": _cpu_s() - used,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6,
        "written_mb": (_written() - written) / 1e6,
    }
    print(json.dumps(took))


@app.command(hidden=True)
def make(folder: Path, responses: Path, first: int, count: int, take_s: float) -> None:
    """Write recordings, and relabel nothing."""
    import scale_recordings

    kept = scale_recordings.kept_responses(responses, -(-count // scale_recordings.SAMPLES))
    scale_recordings.make(folder, kept, first, count, take_s)


@app.command(hidden=True)
def prepare(what: str, project: Path, folder: Path, model: str = "") -> None:
    """Declare the data set, or correct the label of one recording."""
    import scale_recordings

    if what == "relabel":
        scale_recordings.relabel(Paths(project))
    else:
        scale_recordings.declared(Paths(project), [model] if model else [], folder)


def _written(pid: str = "self") -> int:
    """Return the bytes that a process, and its children that are gone, wrote."""
    lines = Path(f"/proc/{pid}/io").read_text().splitlines()
    return int(dict(line.split(": ") for line in lines)["write_bytes"])


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def ours(*arguments: object) -> list[str]:
    """Return the call of a command of this file: this process stays small, since each that it
    starts begins with its peak of memory."""
    return [sys.executable, __file__, *map(str, arguments)]


class Watch:
    """Runs what is measured in the project below `root`; counts the files that it opens, if asked
    to, by strace."""

    def __init__(self, root: Path, asked: Asked, *, opens: bool) -> None:
        self.root, self.asked, self.opens = root, asked, opens
        self.log, self.output = root / "opened.txt", root / "log.txt"

    def run(self, told: str, line: Sequence[str], cwd: Path | None = None) -> dict[str, Any]:
        """Return what a command took, all its processes together; of a stage what it says."""
        if time.monotonic() > self.asked.until:
            return {}
        began = time.perf_counter()
        with self.output.open("wb") as stream:
            child = subprocess.Popen(
                self._around(line),
                cwd=cwd,
                stdout=stream,
                stderr=subprocess.PIPE if cwd is None else subprocess.STDOUT,
                start_new_session=True,
            )
            if not _ended(child.pid, self.asked.stage_s):
                os.killpg(child.pid, signal.SIGKILL)
                os.waitpid(child.pid, 0)
                return {"stage": told, "beyond_s": self.asked.stage_s}
            wall, written = time.perf_counter() - began, _written(str(child.pid))
            _, status, used = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
        said = self.output.read_text(errors="replace")
        if child.returncode:
            wrong = child.stderr.read().decode() if child.stderr else ""
            print(f"{told}: {said[-3000:]}{wrong[-3000:]}", file=sys.stderr)
            return {"stage": told, "failed": child.returncode}
        if self.opens:
            return {"stage": told, "opened": self._opened()}
        if cwd is None:
            return {"stage": told, **json.loads(said.splitlines()[-1])}
        took = {"wall_s": wall, "cpu_s": used.ru_utime + used.ru_stime}
        took |= {"peak_mb": used.ru_maxrss * 1024 / 1e6, "written_mb": written / 1e6}
        return {"stage": told, **took}

    def _around(self, line: Sequence[str]) -> list[str]:
        if not self.opens:
            return list(line)
        calls = "trace=open,openat,openat2"
        return ["strace", "-f", "--seccomp-bpf", "-qq", "-e", calls, "-o", str(self.log), *line]

    def _opened(self) -> int:
        with self.log.open(errors="replace") as lines:
            return sum(str(self.root) in line and " = -1 " not in line for line in lines)


def _ended(pid: int, most_s: float) -> bool:
    """Wait until a child has ended, for so long; it is still to be waited for."""
    until = time.monotonic() + most_s
    while time.monotonic() < until:
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG):
            return True
        time.sleep(0.02)
    return False


def measured(root: Path, size: int, asked: Asked, *, opens: bool) -> Iterator[dict[str, Any]]:
    """Yield what each stage took with `size` recordings; everything is below `root`."""
    folder, project = root / "recordings", Paths(root / "project")
    project.datasets.mkdir(parents=True)
    shutil.copytree(HERE.root / "profiles", project.root / "profiles")
    model = asked.run if size <= asked.most_run else ""
    _quietly("make", folder, asked.responses, 0, size, asked.take_s)
    _quietly("prepare", "declare", project.root, folder, "--model", model)
    watch = Watch(root, asked, opens=opens)

    def staged(name: str) -> dict[str, Any]:
        return watch.run(name, ours("stage", name, project.root, folder))

    for name in STAGES:
        yield staged(name)
    for name in ("publish", "fetch"):
        yield staged(name)
    shutil.rmtree(project.sessions("fetched").parent, ignore_errors=True)
    shutil.rmtree(project.dataset("fetched").parent, ignore_errors=True)
    shutil.rmtree(project.published(NAME), ignore_errors=True)
    if not opens and size <= asked.most_models:
        for name in ("embedding", *(f"model: {one}" for one in asked.models)):
            yield staged(name)
    yield from _commands(project, folder, size, asked, watch, is_whole=bool(model))


def _commands(
    project: Paths, folder: Path, size: int, asked: Asked, watch: Watch, *, is_whole: bool
) -> Iterator[dict[str, Any]]:
    """Yield what commands took. `is_whole`: the workflow makes all, from nothing, models too."""

    def command(told: str, *arguments: str) -> dict[str, Any]:
        return watch.run(told, [*AJGDATA, *arguments], project.root)

    features = str(project.features(NAME).relative_to(project.root))
    again = ("import", str(folder), "--dataset", NAME, "--reference")
    if is_whole:
        for made in (project.results, project.cache):
            shutil.rmtree(made)
        yield command("workflow: all features", "run", NAME, features)
    yield command("workflow: features again, nothing to do", "run", NAME, features)
    if is_whole:
        yield command("workflow: models and report", "run", NAME)
        if not watch.opens:
            yield from _jobs(project)
        yield command("workflow: nothing to do", "run", NAME)
    yield command("status", "status", NAME)
    yield command("info", "info", NAME)
    yield command("import again, nothing new", *again)
    _quietly("make", folder, asked.responses, -(-size // 50), 1, asked.take_s)
    yield command("import of one more", *again)
    yield command("one new recording, to the features", "run", NAME, features)
    _quietly("prepare", "relabel", project.root, folder)
    yield command("one relabelled, to the features", "run", NAME, features)
    if size > 500:
        shutil.rmtree(min(project.sessions(NAME).iterdir()))
        yield command("one session removed, to the features", "run", NAME, features)


def _quietly(*arguments: object) -> None:
    subprocess.run(ours(*arguments), check=True)


def _jobs(project: Paths) -> Iterator[dict[str, Any]]:
    """Yield the CPU time of the run's jobs, by rule, and how large the report is."""
    own = Paths(project.root, NAME)
    for folder in (project.benchmarks, own.of_run / "benchmarks"):
        for job in read_benchmarks(folder):
            if job.rule not in ("features", "merge"):
                name = f", {job.wildcards[-1]}" if job.wildcards[1:] else ""
                yield {"stage": f"job: {job.rule}{name}", "cpu_s": job.cpu_s}
    sizes = {path: path.stat().st_size for path in own.report.parent.rglob("*") if path.is_file()}
    pages = {path: size for path, size in sizes.items() if path.suffix == ".html"}
    heard = {path for path in pages if path.parent.name == NAME}  # scatter plots of embeddings
    yield {
        "stage": "report",
        "page_kb": max(size for path, size in pages.items() if path not in heard) / 1e3,
        "explorer_kb": max((pages[path] for path in heard), default=0) / 1e3,
        "beside_mb": (sum(sizes.values()) - sum(pages.values())) / 1e6,
    }


@app.command()
def measure(
    size: Annotated[list[int], typer.Option(help="recordings (repeat)")] = [  # noqa: B006
        500,
        5_000,
        50_000,
        200_000,
    ],
    take_s: Annotated[float, typer.Option(help="length of a recording, s")] = 0.25,
    run: Annotated[str, typer.Option(help="model of the run with a report")] = "linear",
    most_run: Annotated[int, typer.Option(help="recordings of such a run at most")] = 50_000,
    model: Annotated[list[str], typer.Option(help="models alone (repeat)")] = list(MODELS),  # noqa: B006
    most_models: Annotated[int, typer.Option(help="recordings of a model alone")] = 50_000,
    opens: Annotated[int, typer.Option(help="count opened files up to so many")] = 5_000,
    most_s: Annotated[float, typer.Option(help="begin nothing after so long, s")] = 7_200,
    stage_s: Annotated[float, typer.Option(help="longest stage, s")] = 900,
    responses: Annotated[Path, typer.Option(help="folder of kept responses")] = HERE.responses,
    work: Annotated[Path | None, typer.Option(help="folder for what is made")] = None,
    out: Annotated[Path, typer.Option(help="what was found")] = HERE.results / "scale.json",
) -> None:
    """Measure each size, print the tables, and keep what was found after each size."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    until = time.monotonic() + most_s
    asked = Asked(take_s, responses, run, most_run, model, most_models, stage_s, until)
    about = {"machine": platform.machine(), "cores": os.cpu_count(), "take_s": take_s}
    found: list[dict[str, Any]] = []
    passes = [(count, False) for count in size] + [(n, True) for n in size if n <= opens]
    for count, counts_opens in sorted(passes, key=lambda one: (one[0], one[1])):
        if time.monotonic() > until:
            break
        with tempfile.TemporaryDirectory(dir=work) as temporary:
            root = Path(temporary).resolve()
            for one in measured(root, count, asked, opens=counts_opens):
                if one:
                    found.append({"recordings": count, **one})
                    print(json.dumps(found[-1]), flush=True)
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(json.dumps({**about, "found": found}, indent=1))
    print(scale_table.as_markdown({**about, "found": found}))


@app.command()
def docs(found: Path) -> None:
    """Put the tables of what was found into docs/scale.md."""
    text = scale_table.as_markdown(json.loads(found.read_text()))
    scale_table.into(HERE.root / "docs" / "scale.md", text)


if __name__ == "__main__":
    app()
