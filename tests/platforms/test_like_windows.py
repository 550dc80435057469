"""Commands and Python functions work without what only Linux and macOS have."""

from __future__ import annotations

import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from recorded import record_tones, write_noisy_tone

import ajgdata
from ajgdata.paths import Paths
from ajgdata.store.files import read_csv

ROOT = Path(__file__).resolve().parents[2]
LIKE_WINDOWS = Path(__file__).parent / "like_windows"
#: A character of cp1252, and letters that cp1252 does not have.
LABELS = ("würfel", "κύβος")
PATTERN = r"(?P<session>[^_]+)_(?P<label>.+)_(?P<grasp>\d+)\.wav"
#: Parts of the package that use signals, processes, terminals and files.
USING_THE_SYSTEM = ("acquire", "cli", "live", "loading", "store")
COMMAND = "from ajgdata.cli import main; main()"


@pytest.fixture
def project(tmp_path) -> Paths:
    """An empty project in a folder with a name that shells and old encodings take apart."""
    paths = Paths(tmp_path / "Größe & Masse (neu)")
    paths.datasets.mkdir(parents=True)
    return paths


def python(project: Paths, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python in the project as on Windows, with an output of 256 characters."""
    folders = [ROOT, ROOT / "workflow/logger"]
    if sys.platform == "linux":
        folders.insert(0, LIKE_WINDOWS)
    path = os.pathsep.join(map(str, folders))
    environment = {name: text for name, text in os.environ.items() if name != "AJGDATA_ROOT"}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=project.root,
        env=environment | {"PYTHONPATH": path, "PYTHONIOENCODING": "cp1252"},
        check=False,
        capture_output=True,
        encoding="cp1252",
    )


def ajgdata_command(project: Paths, *arguments: str, code: int = 0) -> str:
    """Run `ajgdata` in the project as on Windows; return what it prints to standard output."""
    process = python(project, "-c", COMMAND, *arguments)
    assert process.returncode == code, process.stdout + process.stderr
    return process.stdout


def test_modules_that_use_the_operating_system_can_be_imported(project):
    names = [
        module.name
        for module in pkgutil.walk_packages(ajgdata.__path__, "ajgdata.")
        if module.name.split(".")[1] in USING_THE_SYSTEM
    ]
    assert len(names) > 60
    process = python(project, "-c", "\n".join(f"import {name}" for name in names))
    assert process.returncode == 0, process.stderr


def test_import_check_load_and_doctor(project, tmp_path):
    folder = tmp_path / "Töne"
    for number, label in enumerate(LABELS):
        for grasp in range(1, 5):
            file = folder / f"aux_{label}_{grasp}.wav"
            write_noisy_tone(file, 400 * (1 + number) + 20 * grasp, seed=10 * number + grasp)
    options = ("--dataset", "mine", "--pattern", PATTERN)
    ajgdata_command(project, "import", str(folder), *options)
    (session,) = (path.name for path in (project.recordings("mine") / "sessions").iterdir())
    assert session.startswith("aux-")
    _, rows = read_csv(project.recordings_file("mine", session))
    assert {row["file"] for row in rows} == {
        f"audio/aux_{label}_{grasp}.wav" for label in LABELS for grasp in range(1, 5)
    }
    assert "0 errors" in ajgdata_command(project, "check", "mine")
    assert "cores, " in ajgdata_command(project, "doctor")
    code = "import ajgdata; print(ajgdata.load_recordings('mine').waveform.load().shape[0])"
    process = python(project, "-c", code)
    assert process.stdout.split() == ["8"], process.stderr


def test_a_message_with_characters_outside_the_encoding_has_escapes(project):
    printed = ajgdata_command(project, "import", "κύβος", "--dataset", "mine", code=1)
    assert printed == ""
    process = python(project, "-c", COMMAND, "check", "κύβος")
    assert process.returncode == 1
    assert process.stderr.startswith("error ")
    code = "from ajgdata.cli.console import print_any_character, say\n"
    code += "print_any_character(); say('\\u03ba \\xfc')"
    assert python(project, "-c", code).stdout == "\\u03ba ü\n"


@pytest.mark.slow
def test_a_run_with_plain_models(project):
    declaration = {
        "name": "tones",
        "description": "Sines of two pitches, for tests.",
        "targets": {"pitch": {"kind": "classification"}},
        "tasks": {"pitch": {"target": "pitch", "folds": 3, "models": ["knn_plain"]}},
    }
    file = project.dataset("tones")
    file.parent.mkdir(parents=True)
    file.write_text(yaml.safe_dump(declaration), encoding="utf-8")
    record_tones(project, ("day1", "day2"))
    ajgdata_command(project, "run", "tones", "--cores", "2")
    code = "import ajgdata; print(len(ajgdata.load_features('tones').recording))"
    process = python(project, "-c", code)
    assert process.stdout.split() == ["16"], process.stderr
    report = Paths(project.root, run="tones").report
    assert report.is_file()
