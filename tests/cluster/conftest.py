"""A SLURM of two nodes on this machine, and a small project run without and with it."""

import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
import yaml
from recorded import record_tones
from runs import FEATURES, TARGETS, Project

from tools.loopback_slurm import Slurm, loopback_slurm, missing

#: Set it to fail, rather than skip, where SLURM cannot be started.
REQUIRED = "AJGDATA_REQUIRE_CLUSTER"
SESSIONS = tuple(f"day{n}" for n in range(1, 5))
TONES = {
    "name": "tones",
    "description": "Sines of two pitches, for tests.",
    "targets": {"pitch": {"kind": "classification"}},
    "tasks": {
        "pitch": {
            "target": "pitch",
            "folds": 2,
            "models": ["knn_plain"],
        }
    },
}
CUBES = {
    "name": "cubes",
    "title": "Edge length of cubes",
    "description": "Two cubes on a coarse grid, for tests.",
    "licence": "CC0-1.0",
    "targets": {"edge_mm": {"kind": "regression", "unit": "mm", "description": "edge length"}},
    "tasks": {"size": {"target": "edge_mm", "folds": 2, "models": ["ridge_plain"]}},
    "recipe": {
        "seed": 1,
        "grasps_per_object": 2,
        "vary": {"angle_deg": [-10, 10]},
        "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.006}},
        "objects": [
            {
                "name": f"cube_{edge:g}",
                "shape": {"kind": "cube", "edge_mm": edge},
                "targets": {"edge_mm": edge},
            }
            for edge in (12.0, 24.0)
        ],
    },
}
SETTINGS = {"pages": [], "publish": ["cubes"], "quick": True}


# Lets fixtures end what they started, as after Ctrl-C.
signal.signal(signal.SIGTERM, signal.default_int_handler)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.cluster)


@pytest.fixture(scope="session")
def _can_start() -> None:
    absent = missing()
    if not absent and find_spec("snakemake_executor_plugin_slurm") is None:
        absent = "no snakemake-executor-plugin-slurm here (make .venv/.cluster)"
    if absent:
        (pytest.fail if REQUIRED in os.environ else pytest.skip)(absent)


@pytest.fixture
def slurm(_can_start) -> Iterator[Slurm]:
    """Two nodes of one CPU and 4000 MB each, in a folder with a short path: they create sockets in
    it, whose paths have 108 characters or fewer."""
    with (
        tempfile.TemporaryDirectory(prefix="slurm-") as folder,
        loopback_slurm(Path(folder) / "s", nodes=2, cpus=1) as running,
    ):
        yield running


@pytest.fixture(scope="session")
def recorded(tmp_path_factory) -> Project:
    """Tones recorded on four days, and cubes that the workflow still has to record."""
    root = tmp_path_factory.mktemp("recorded")
    project = Project(root)
    for declared in (TONES, CUBES):
        path = project.paths.dataset(declared["name"])
        path.parent.mkdir(parents=True)
        path.write_text(yaml.safe_dump(declared, sort_keys=False))
    (root / "settings.yaml").write_text(yaml.safe_dump(SETTINGS))
    record_tones(project.paths, SESSIONS, count=6)
    return project


def copy_of(recorded: Project, folder: Path) -> Project:
    """Return a copy of the recordings, without results."""
    return Project(Path(shutil.copytree(recorded.root, folder / "project")))


@pytest.fixture(scope="session")
def reference(_can_start, recorded, tmp_path_factory) -> Project:
    """The same after a run without SLURM."""
    project = copy_of(recorded, tmp_path_factory.mktemp("reference"))
    project.run_here(*TARGETS)
    return project


@pytest.fixture(scope="session")
def features(_can_start, recorded, tmp_path_factory) -> Project:
    """The same after the features of a data set were made without SLURM."""
    project = copy_of(recorded, tmp_path_factory.mktemp("features"))
    project.run_here(FEATURES)
    return project


@pytest.fixture
def project(recorded, tmp_path: Path) -> Project:
    return copy_of(recorded, tmp_path)
