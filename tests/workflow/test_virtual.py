"""The workflow records virtual sessions: light to plan, each session once, each scene once."""

import os
import re
import subprocess
import sys

import pytest
import yaml
from conftest import ROOT, Project, snakemake_here

from ajgdata.paths import Paths
from ajgdata.store.session_audio import check_session

RECIPE = {
    "sessions": 2,
    "grasps_per_object": 1,
    "scene": {"numerics": {"dx_mm": 6, "max_time_s": 0.004}},
    "objects": [
        {
            "name": "cube",
            "shape": {"kind": "cube", "edge_mm": 20, "material": "pla"},
            "targets": {"edge_mm": 20},
        },
        {
            "name": "rod",  # pinches the cavity where it stands
            "shape": {"kind": "cylinder", "diameter_mm": 5, "height_mm": 140},
            "targets": {"edge_mm": 5},
        },
    ],
}
DECLARATION = {"name": "made", "targets": {"edge_mm": {"kind": "regression", "unit": "mm"}}}


@pytest.fixture
def simulation(tmp_path) -> Project:
    project = Project(tmp_path)
    recipe = {**RECIPE, "scene": {**RECIPE["scene"], "grasp": {"offset_x_mm": 45}}}
    path = project.paths.dataset("made")
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump({**DECLARATION, "recipe": recipe}))
    return project


def test_sessions_are_recorded_once_and_a_changed_recipe_records_what_it_concerns(simulation):
    wanted = [str(Paths().features("made"))]
    assert simulation.planned(*wanted) == {"acquire": 2, "features": 1}
    console = simulation.snakemake(*wanted)
    for session in ("virtual-01", "virtual-02"):
        saved = rf"made/{session}: left out: elastic, frame, motion; time [+-]\d+ %; error \S+ \("
        assert re.search(rf"{saved}measured on {session}_cube_01\)", console)
        log = (simulation.root / f"results/logs/acquire/made.{session}.log").read_text()
        *_, first, second = log.splitlines()
        assert first == "1 recorded, 0 already there, 1 scenes solved"
        assert re.match(rf"skipped {session}_rod_01: .*pinches the cavity", second)
        result = check_session(simulation.paths.session("made", session))
        assert [file.recording_id for file in result.files] == [f"{session}_cube_01_1"]
        assert [finding.code for finding in result.findings] == ["skipped"]
    assert len(list(simulation.paths.responses.rglob("*.npz"))) == 2
    assert simulation.planned(*wanted) == {}
    path = simulation.paths.dataset("made")
    declared = yaml.safe_load(path.read_text())
    declared["recipe"]["sessions"] = 3
    path.write_text(yaml.safe_dump(declared))
    assert simulation.jobs_of(*wanted) == {
        ("acquire", "made", "virtual-03"): 1,
        ("features", "made"): 1,
    }
    simulation.snakemake(*wanted)
    assert simulation.planned(*wanted) == {}  # the digest of the new session is not a change
    table = simulation.paths.recordings_file("made", "virtual-01")
    content = table.read_text()
    assert ",ok" in content
    table.write_text(content.replace(",ok", ",reject", 1))
    os.utime(table, (1e9, 1e9))
    assert simulation.planned(*wanted) == {"features": 1}
    simulation.snakemake(*wanted)
    assert simulation.planned(*wanted) == {}  # the hidden change is computed once
    table.write_text(content)
    declared["recipe"]["seed"] = 5
    path.write_text(yaml.safe_dump(declared))
    assert simulation.planned(*wanted) == {"acquire": 3, "features": 1}


@pytest.mark.slow
def test_sessions_that_share_scenes_solve_each_once(simulation):
    """Whatever the order of the jobs: with two cores both would begin at the same time."""
    for name, signal in {
        "a_loud": {"external_noise_dba": 80},
        "quiet": {"noise_db_spl": 30},
    }.items():
        path = simulation.paths.dataset(name)
        path.parent.mkdir()
        path.write_text(
            yaml.safe_dump({"name": name, "from": "made", "recipe": {"signal": signal}})
        )
    names = ("a_loud", "made", "quiet")
    ends = [str(Paths().acquired(name, f"virtual-0{n}")) for name in names for n in (1, 2)]
    simulation.snakemake(*ends)
    logs = {name: _logged(simulation, name) for name in names}
    solved = {name: re.findall(r", (\d+) scenes solved", text) for name, text in logs.items()}
    assert solved == {"a_loud": ["0", "0"], "made": ["1", "1"], "quiet": ["0", "0"]}
    assert len(list(simulation.paths.responses.rglob("*.npz"))) == 2
    simulation.snakemake(ends[2], "--force")
    assert simulation.planned(*ends) == {}  # recording the first again does not redo the others
    assert "0 scenes solved" in _logged(simulation, "made")


def _logged(project, dataset):
    folder = project.root / "results/logs/acquire"
    return "".join(path.read_text() for path in sorted(folder.glob(f"{dataset}.*.log")))


def test_a_dry_run_pays_for_no_compiler(simulation):
    """Neither the main process nor what it imports: numba would be compiled or loaded there."""
    command = [sys.executable, "-X", "importtime", "-m", "snakemake", "--dry-run", "--cores", "2"]
    command += [
        "--snakefile",
        str(ROOT / "workflow/Snakefile"),
        "--directory",
        str(simulation.root),
    ]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ)
    imported = set(re.findall(r"^import time:.*\| +([\w.]+)$", done.stderr, flags=re.M))
    assert {"ajgdata.gripper.scene", "ajgdata.pipeline.plan"} <= imported
    assert not {name for name in imported if name.split(".")[0] in ("numba", "llvmlite", "torch")}
    assert "Recording session virtual-01" in done.stdout + done.stderr


def test_the_opening_picture_is_of_a_task_that_tells_objects(simulation):
    """It waits for the predictions; without pages, and without such a task, there is none."""
    pages = ("--config", "pages=['accuracy']")
    path = simulation.paths.dataset("made")
    declared = yaml.safe_load(path.read_text())
    declared["targets"]["object"] = {"kind": "classification"}
    declared["tasks"] = {"edge": {"target": "edge_mm", "models": ["knn"], "folds": 2}}
    path.write_text(yaml.safe_dump(declared))
    folder = str(simulation.paths.opening.parent.relative_to(simulation.root))
    listed = simulation.arguments("--dry-run", folder, *pages)
    assert snakemake_here(*listed) != 0
    declared["tasks"]["object"] = {"target": "object", "models": ["cnn", "knn"], "folds": 2}
    path.write_text(yaml.safe_dump(declared))
    planned = simulation.planned(folder, *pages)
    assert (planned["opening"], planned["experiment"], planned["acquire"]) == (1, 1, 2)
    assert snakemake_here(*simulation.arguments("--dry-run", folder)) != 0
