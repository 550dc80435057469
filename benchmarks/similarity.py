"""Measure time and memory of the comparison of fingerprints, with planted copies.

    python benchmarks/similarity.py [NUMBER]

NUMBER is the number of recordings, each a random spectrum of 1,025 bins. There are three kinds:

- random: each recording is a grasp;
- clustered: 20 objects have grasps of 50 recordings;
- equal: all spectra are equal, and the search stops at its limit of pairs.

The first two kinds contain 50 copies, with a deviation of 1 %, in other grasps. The last column is
the number of pairs that the search returns.
"""

from __future__ import annotations

import resource
import sys
import time

import numpy as np

from ajgdata.features import similarity

FREQUENCY_HZ = np.arange(1025) * 44_100 / 2048
COPIES = 50
SAMPLES = 50
OBJECTS = 20
DEVIATION = 0.15  #: relative standard deviation of the noise of a recording


def spectra(kind: str, count: int) -> tuple[np.ndarray, list[str]]:
    """Return spectra (count, 1025) with planted copies, and the names of their grasps."""
    random = np.random.default_rng(0)
    grasp = np.arange(count) if kind == "random" else np.arange(count) // SAMPLES
    noise = 1 + DEVIATION * random.standard_normal((count, 1025), np.float32)
    values = noise.clip(0.1)
    if kind == "equal":
        return np.ones_like(values), np.arange(count).astype(str).tolist()
    if kind == "clustered":
        objects = np.exp(random.normal(size=(OBJECTS, 1025))).astype(np.float32)
        values *= objects[grasp % OBJECTS]
    for number in range(COPIES):
        deviation = 1 + 0.01 * random.standard_normal(1025)
        values[count - 1 - SAMPLES * number] = values[SAMPLES * number] * deviation
    return values, grasp.astype(str).tolist()


def main() -> None:
    """Print one row per kind of spectra."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50_000
    print("kind, recordings, CPU time s, wall time s, peak memory MB, pairs")
    for kind in ("random", "clustered", "equal"):
        values, grasps = spectra(kind, count)
        cpu_s = time.process_time()
        wall_s = time.perf_counter()
        prints = similarity.fingerprints(values, FREQUENCY_HZ, "magnitude")
        limit = similarity.tolerance(prints, grasps)
        pairs = similarity.similar_pairs(prints, grasps, limit)
        cpu_s = time.process_time() - cpu_s
        wall_s = time.perf_counter() - wall_s
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{kind}, {count}, {cpu_s:.1f}, {wall_s:.1f}, {peak_mb:.0f}, {len(pairs.first)}")


if __name__ == "__main__":
    main()
