"""The machine and the installation, as a bug report should describe them."""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from ajgdata.paths import Paths
from ajgdata.store.files import bytes_below
from ajgdata.store.provenance import software

GB = 1e9
#: Their versions change results or files.
PACKAGES = (
    "numpy", "scipy", "torch", "scikit-learn", "numba", "xarray", "h5py", "h5netcdf", "soundfile",
    "pydantic", "snakemake",
)  # fmt: skip
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
#: A run of everything that is declared here takes about this much.
ROOM_BYTES = 3 * GB


def doctor(paths: Paths | None, room_bytes: float = ROOM_BYTES) -> tuple[dict[str, str], list[str]]:
    """Return facts by topic, and a line with its fix for each thing that is wrong.

    `paths`: None outside a project. Less than `room_bytes` free on its disk is wrong.
    """
    made = software()
    facts = {
        "ajgdata": f"{made['ajgdata_version']}, commit {made['git_commit'] or 'unknown'}",
        "python": f"{platform.python_version()} ({sys.executable})",
        "system": f"{platform.platform()}, {platform.machine()}",
        "packages": ", ".join(f"{name} {version(name)}" for name in PACKAGES),
        **_backends(),
        "cores": _cores(),
        "threads": ", ".join(f"{n}={os.environ[n]}" for n in THREAD_VARIABLES if n in os.environ)
        or "not limited by the environment",
    }
    wrong = [
        f"{name} is not installed; run `make test`" for name in missing(requires("ajgdata") or ())
    ]
    if paths is None:
        return {**facts, "project": "none here or above"}, wrong
    free = shutil.disk_usage(paths.root).free
    facts["project"] = str(paths.root)
    facts["disk"] = (
        f"{free / GB:.1f} GB free; data {_size(paths.data)}, results {_size(paths.results)}"
    )
    facts["caches"] = f"responses {_size(paths.responses)}, all of .ajgdata {_size(paths.cache)}"
    if free < room_bytes:
        wrong.append(
            f"{free / GB:.1f} GB free on disk; `make clean` removes what can be made again"
        )
    if not os.access(paths.root, os.W_OK):
        wrong.append(f"{paths.root} cannot be written; correct its permissions")
    return facts, wrong


def _size(folder: Path) -> str:
    return f"{bytes_below(folder) / GB:.2f} GB"


def _cores() -> str:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return f"{usable} of {os.cpu_count()} usable, {memory / GB:.1f} GB of memory"


def _backends() -> dict[str, str]:
    """Return the devices and threads that compute.

    The libraries themselves are asked, which takes a second or two.
    """
    import h5py
    import soundfile
    import torch
    from threadpoolctl import threadpool_info

    blas = {
        f"{one['internal_api']} {one['version']} ({one['num_threads']} threads)"
        for one in threadpool_info()
        if one["user_api"] == "blas"
    }
    gpu = torch.cuda.get_device_name() if torch.cuda.is_available() else "no CUDA device"
    return {
        "torch": f"{torch.get_num_threads()} threads, {gpu}; models are trained on the CPU",
        "blas": ", ".join(sorted(blas)) or "none found",
        "files": f"HDF5 {h5py.version.hdf5_version}, libsndfile {soundfile.__libsndfile_version__}",
    }


def missing(requirements: Iterable[str]) -> list[str]:
    """Return the names of required packages that are not installed; extras do not count."""
    absent = []
    for requirement in requirements:
        name = re.split(r"[^A-Za-z0-9._-]", requirement)[0]
        try:
            version(name)
        except PackageNotFoundError:
            absent += [] if "extra ==" in requirement else [name]
    return absent
