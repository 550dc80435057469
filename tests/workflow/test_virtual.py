"""The workflow records virtual sessions: light to plan, each session once, each scene once."""

import json
import os
import re
import subprocess
import sys

import pytest
import yaml
from conftest import ROOT, Project

RECIPE = {
    "sessions": 2,
    "grasps_per_object": 1,
    "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.004}},
    "objects": [
        {"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}, "targets": {"edge_mm": 20}},
        {
            "name": "rod",  # pinches the cavity where it stands
            "shape": {"kind": "cylinder", "diameter_mm": 5, "height_mm": 140},
            "targets": {"edge_mm": 5},
        },
    ],
}
DECLARATION = {"name": "made", "targets": {"edge_mm": {"kind": "regression", "unit": "mm"}}}


@pytest.fixture
def made(tmp_path) -> Project:
    project = Project(tmp_path)
    recipe = {**RECIPE, "scene": {**RECIPE["scene"], "grasp": {"offset_x_mm": 45}}}
    path = project.paths.dataset("made")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump({**DECLARATION, "recipe": recipe}))
    return project


def test_sessions_are_recorded_once_and_a_bad_grasp_does_not_stop_them(made):
    sessions = ("virtual-01", "virtual-02")
    manifests = {name: made.paths.audio_manifest("made", name) for name in sessions}
    wanted = [str(path.relative_to(made.root)) for path in manifests.values()]
    assert made.planned(*wanted) == {"acquire": 2}
    made.snakemake(*wanted)
    for session, manifest in manifests.items():
        log = (made.root / f"results/logs/acquire/made.{session}.log").read_text()
        first, second = log.splitlines()
        assert first == "1 recorded, 0 already there"
        assert re.match(rf"skipped {session}_rod_01: .*pinches the cavity", second)
        content = json.loads(manifest.read_text())
        assert [one["recording_id"] for one in content["recordings"]] == [f"{session}_cube_01_1"]
        assert [one["code"] for one in content["findings"]] == ["skipped"]
    assert made.planned(*wanted) == {}
    assert len(list(made.paths.responses.rglob("*.response"))) == 2


def test_a_dry_run_pays_for_no_compiler(made):
    """Neither the main process nor what it imports: numba would be compiled or loaded there."""
    command = [sys.executable, "-X", "importtime", "-m", "snakemake", "--dry-run", "--cores", "2"]
    command += ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(made.root)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ)
    imported = set(re.findall(r"^import time:.*\| +([\w.]+)$", done.stderr, flags=re.M))
    assert {"ajgdata.gripper.scene", "ajgdata.pipeline.plan"} <= imported
    assert not {name for name in imported if name.split(".")[0] in ("numba", "llvmlite", "torch")}
    assert "Recording session virtual-01" in done.stdout + done.stderr
