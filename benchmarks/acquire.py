"""Time of recording simulated data sets: what a second process gains, and what the cache saves.

Run `python benchmarks/acquire.py` for a sample of scenes, `--scenes 1300` for as many as the
paper's data sets have grasps. Only what was run is called measured; times for more scenes are
extrapolated from the pace after the start, and say so. Pairs are interleaved, so that a busy
machine disturbs both sides alike; on a machine whose cores are taken, two processes gain nothing.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor, wait
from pathlib import Path
from time import perf_counter

import numpy as np
import yaml
from rich.console import Console
from rich.table import Table

from ajgdata import gripper
from ajgdata.paths import Paths
from ajgdata.pipeline.acquire import acquire_all

#: Grasps of the paper's data sets, about.
ALL_SCENES = 1_300
CUBES = [10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 22.0, 24.0, 27.0, 30.0]
SESSIONS = ("virtual-01", "virtual-02")


def scenes(count: int, first_seed: int, numerics: dict) -> list[gripper.Scene]:
    return [
        gripper.Scene.model_validate(
            {
                "object": {"kind": "cube", "edge_mm": CUBES[n % len(CUBES)]},
                "grasp": {"seed": first_seed + n},
                "numerics": numerics,
            }
        )
        for n in range(count)
    ]


def solve(some: list[gripper.Scene]) -> float:
    """Wall seconds."""
    start = perf_counter()
    for scene in some:
        gripper.simulate(scene)
    return perf_counter() - start


def two_against_one(count: int, repeats: int, numerics: dict) -> list[float]:
    """Scenes per second of two processes over those of one, once a repeat.

    Each process solves the same scenes; one alone, then both at once.
    """
    some = scenes(count, 0, numerics)
    context = multiprocessing.get_context("spawn")
    with (
        ProcessPoolExecutor(1, mp_context=context) as one,
        ProcessPoolExecutor(1, mp_context=context) as other,
    ):
        wait([one.submit(solve, some[:1]), other.submit(solve, some[:1])])  # compiled and loaded
        ratios = []
        for _ in range(repeats):
            alone = one.submit(solve, some).result()
            both = [one.submit(solve, some), other.submit(solve, some)]
            ratios.append(2 * alone / max(future.result() for future in both))
    return ratios


def acquisition(paths: Paths, cores: int) -> tuple[float, float]:
    """Seconds of the first session, start of the processes included, and of the second."""
    times = [perf_counter()]
    for _, _, done in acquire_all(paths, [("bench", name) for name in SESSIONS], cores):
        times.append(perf_counter())
        assert not done.kept and not done.skipped
    first, second = np.diff(times)
    return first, second


def project(folder: Path, count: int, numerics: dict) -> tuple[Paths, int]:
    """A project with a recipe of at least `count` scenes; the number it has."""
    each = -(-count // (len(SESSIONS) * len(CUBES)))
    recipe = {
        "sessions": len(SESSIONS),
        "grasps_per_object": each,
        "scene": {"numerics": numerics},
        "vary": {"angle_deg": [-10, 10], "offset_x_mm": [-2, 2], "offset_y_mm": [-2, 2]},
        "objects": [
            {"name": f"cube_{edge:g}", "shape": {"kind": "cube", "edge_mm": edge}} for edge in CUBES
        ],
    }
    paths = Paths(folder)
    paths.dataset("bench").parent.mkdir(parents=True)
    paths.dataset("bench").write_text(yaml.safe_dump({"name": "bench", "recipe": recipe}))
    return paths, len(SESSIONS) * each * len(CUBES)


def record(console: Console, count: int, cores: int, numerics: dict) -> None:
    """Record, throw the recordings away, record again from the kept responses."""
    with tempfile.TemporaryDirectory() as folder:
        paths, made = project(Path(folder), count, numerics)
        table = Table(title=f"recording {made} scenes, {cores} processes")
        for heading in ("", f"all {made}, s", "each, once begun, s", f"{ALL_SCENES}, s"):
            table.add_column(heading, justify="right" if heading else "left")
        paces = []
        for name in ("simulated", "again, from kept responses"):
            first, second = acquisition(paths, cores)
            paces.append(second / (made / 2))
            # The second half has the pace of any that follow: it pays for no start.
            beyond = f"{first + second + (ALL_SCENES - made) * paces[-1]:.0f} (extrapolated)"
            whole = "measured" if made >= ALL_SCENES else beyond
            table.add_row(name, f"{first + second:.1f}", f"{paces[-1]:.4f}", whole)
            for path in paths.sessions("bench").rglob("*.wav"):
                path.unlink()
    console.print(table)
    console.print(f"from a kept response: {paces[1] / paces[0]:.3f} of the time")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", "--scenes", type=int, default=20)
    parser.add_argument("--pairs", type=int, default=3, help="one process against two, repeats")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--dx-mm", type=float, help="default: that of the gripper")
    arguments = parser.parse_args()
    numerics = {"dx_mm": arguments.dx_mm} if arguments.dx_mm else {}
    console = Console(width=110)
    console.print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    ratios = two_against_one(4, arguments.pairs, numerics)
    shown = ", ".join(f"{ratio:.2f}" for ratio in ratios)
    console.print(f"two processes over one, 4 scenes each: {np.median(ratios):.2f} ({shown})")
    record(console, arguments.scenes, arguments.cores, numerics)


if __name__ == "__main__":
    main()
