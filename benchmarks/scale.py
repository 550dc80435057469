"""Measure time, memory and written bytes of each command for 500, 5,000 and 50,000 recordings.

    python benchmarks/scale.py [--size 500 ...] [--length-s 0.25] [--max-report 5000] [--write]

Each size has a temporary project. The recordings have no meaning: they are four simulated responses
to one sweep, with seeded noise, 50 recordings per grasp and 10 grasps per session. They are
imported by reference. A command is measured as a user runs it, with its start-up. CPU time and
written bytes are those of the command and its finished child processes. Memory is the peak of the
largest process. `--write` writes the table into docs/scale.md.
"""

from __future__ import annotations

import json
import os
import platform
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import typer
import yaml

ROOT = Path(__file__).resolve().parents[1]
AJGDATA = str(Path(sys.executable).with_name("ajgdata"))
SNAKEMAKE = (sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "workflow/Snakefile"))
PAGE = ROOT / "docs/scale.md"
# Markers before and after the table.
BEGIN = "<!-- benchmarks/scale.py -->"
END = "<!-- end -->"
SAMPLES = 50  #: recordings per grasp
GRASPS = 10  #: grasps per session
RATE_HZ = 44_100
NOISE = 3e-4  #: rms, full scale 1
# Commands before which the data change.
ONE_MORE = "import of one more"
CHANGED_LABEL = "features after one changed label"
#: Edge lengths of the simulated cubes.
EDGES_MM = (12, 18, 24, 30)
DATASET = {
    "name": "scale",
    "title": "Scale test: four simulated responses with noise, no evidence",
    "licence": "CC0-1.0",
    "targets": {"object": {"kind": "classification"}},
    "tasks": {"object": {"target": "object", "folds": 5, "models": ["linear"]}},
    "imports": {
        "pattern": r"(?P<session>s\d+)/(?P<grasp>g\d+)_(?P<object>\w+)_(?P<sample>\d+)\.wav"
    },
}
Row = dict[str, object]


def write_recordings(folder: Path, first: int, count: int, length_s: float) -> None:
    """Write the recordings number `first` to `first + count - 1`, simulated on a coarse grid."""
    import numpy as np
    import soundfile

    from ajgdata import gripper
    from ajgdata.acquire.excitation import excitation_samples
    from ajgdata.types import DEFAULT_EXCITATION

    sweep = excitation_samples(DEFAULT_EXCITATION, RATE_HZ)
    chain = gripper.SignalChain(noise_db_spl=None)
    scenes = (
        {"object": {"kind": "cube", "edge_mm": edge}, "numerics": {"dx_mm": 6, "max_time_s": 0.006}}
        for edge in EDGES_MM
    )
    responses = [gripper.simulate(gripper.Scene.model_validate(scene)) for scene in scenes]
    clean = [gripper.record(response, sweep, chain).samples for response in responses]
    frames = round(length_s * RATE_HZ)
    for number in range(first, first + count):
        grasp = number // SAMPLES
        kind = number // SAMPLES % len(clean)
        session = folder / f"s{grasp // GRASPS:04d}"
        session.mkdir(parents=True, exist_ok=True)
        noise = np.random.default_rng(number).standard_normal(frames)
        path = session / f"g{grasp:05d}_cube{EDGES_MM[kind]}_{number % SAMPLES + 1:02d}.wav"
        soundfile.write(path, clean[kind][:frames] + NOISE * noise, RATE_HZ, subtype="PCM_24")


def in_child(function: Callable[..., None], *arguments: object) -> None:
    """Call a function in a child process.

    This process stays small, because the peak memory of a command starts with that of its parent.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        pool.submit(function, *arguments).result()


def change_label(project: Path) -> None:
    """Correct the label of one recording in the recordings.csv of the last session."""
    path = max((project / "data/scale/sessions").iterdir()) / "recordings.csv"
    path.write_text(re.sub(r",cube\d+", ",cube18", path.read_text(), count=1))


def cost(project: Path, arguments: tuple[str, ...]) -> Row:
    """Run one command, and return its CPU time, peak memory and written bytes, or its exit code."""
    with tempfile.TemporaryFile() as output:
        start = time.perf_counter()
        child = subprocess.Popen(arguments, cwd=project, stdout=output, stderr=subprocess.STDOUT)
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)  # keeps /proc/PID until wait4
        wall_s = time.perf_counter() - start
        counters = Path(f"/proc/{child.pid}/io").read_text().splitlines()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode:
            output.seek(0)
            print(output.read().decode(errors="replace")[-2000:], file=sys.stderr)
            return {"cost": f"exit code {child.returncode}"}
    written = int(dict(line.split(": ") for line in counters)["write_bytes"])
    return describe(wall_s, usage, written)


def describe(wall_s: float, usage: resource.struct_rusage, written: int) -> Row:
    """Return the figures of a command, and the table cell that shows them."""
    cpu_s = usage.ru_utime + usage.ru_stime
    peak_mb = usage.ru_maxrss * 1024 / 1e6
    written_mb = written / 1e6
    text = f"{cpu_s:.1f} s; {peak_mb:.0f}; {written_mb:.0f}"
    return {"cpu_s": cpu_s, "wall_s": wall_s, "peak_mb": peak_mb, "cost": text}


def commands(folder: Path, report: bool) -> dict[str, tuple[str, ...]]:
    """Return the arguments of each measured command by name, in order.

    `report` is whether models and report are measured.
    """
    scan = (AJGDATA, "import", str(folder), "--dataset", "scale", "--reference")
    features = (*SNAKEMAKE, "results/features/scale.nc", "--config", "datasets=[scale]")
    run = (AJGDATA, "run", "scale")
    named = {
        "import": scan,
        "check": (AJGDATA, "check", "scale"),
        "features": features,
        "features, up to date": features,
        "models and report": run,
        "status": (AJGDATA, "status", "scale"),
        "publish": (AJGDATA, "publish", "scale"),
        "fetch the published folder": (
            AJGDATA,
            "fetch",
            "results/published/scale",
            "--name",
            "copy",
        ),
        "import again": scan,
        ONE_MORE: scan,
        "features after one new recording": features,
        "models and report after one new recording": run,
        CHANGED_LABEL: features,
    }
    return {name: arguments for name, arguments in named.items() if report or arguments != run}


def measure(size: int, length_s: float, report: bool) -> Iterator[Row]:
    """Yield one row per command, for `size` recordings in a temporary project."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "recordings"
        project = Path(temporary) / "project"
        dataset = project / "datasets/scale/dataset.yaml"
        dataset.parent.mkdir(parents=True)
        dataset.write_text(yaml.safe_dump(DATASET))
        shutil.copytree(ROOT / "profiles", project / "profiles")
        in_child(write_recordings, folder, 0, size, length_s)
        for name, arguments in commands(folder, report).items():
            if name == ONE_MORE:
                in_child(write_recordings, folder, size, 1, length_s)
            elif name == CHANGED_LABEL:
                change_label(project)
            yield {"command": name, "recordings": size, **cost(project, arguments)}


def as_markdown(rows: list[Row], length_s: float) -> str:
    """Return a table with one row per command and one column per size."""
    import pandas as pd

    table = pd.DataFrame(rows).pivot(index="command", columns="recordings", values="cost")
    table = table.reindex(list(dict.fromkeys(row["command"] for row in rows))).fillna("–")
    sizes = [f"{size:,}" for size in table.columns]
    lines = [["command", *sizes], ["---", *("---" for _ in sizes)]]
    lines += [[name, *cells] for name, cells in zip(table.index, table.to_numpy(), strict=True)]
    machine = f"{os.cpu_count()} cores ({platform.machine()})"
    title = f"Recordings of {length_s:g} s, {machine}. CPU time; peak memory, MB; written, MB:"
    return title + "\n\n" + "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def main(
    size: Annotated[list[int] | None, typer.Option(help="recordings (repeat)")] = None,
    length_s: Annotated[float, typer.Option(help="length of a recording, s")] = 0.25,
    max_report: Annotated[int, typer.Option(help="largest size with models and report")] = 5_000,
    write: Annotated[bool, typer.Option(help="put the table into docs/scale.md")] = False,
) -> None:
    """Measure each size and print the table."""
    rows = []
    for count in size or (500, 5_000, 50_000):
        for row in measure(count, length_s, count <= max_report):
            print(json.dumps(row), file=sys.stderr)
            rows.append(row)
    table = as_markdown(rows, length_s)
    print(table)
    if write:
        before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
        after = rest.split(END)[1]
        PAGE.write_text(f"{before}{BEGIN}\n\n{table}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    typer.run(main)
