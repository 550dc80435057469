"""The commands of docs/start.md exist, and the paths without hardware print what the page shows."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from ajgdata.cli import app

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs/start.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", TEXT, flags=re.M | re.S)
LINES = [
    line.partition("  #")[0].strip()
    for kind, text in BLOCKS
    if kind == "sh"
    for line in text.splitlines()
]
COMMANDS = [line for line in LINES if line.startswith("ajgdata ")]
#: Commands that need the network or a sound card, or serve a page until Ctrl-C.
NOT_RUN = ("ajgdata fetch", "ajgdata device", "ajgdata record mine", "ajgdata browse")


@pytest.mark.parametrize("line", COMMANDS)
def test_commands_and_options_exist(line):
    command, arguments = typer.main.get_command(app), shlex.split(line)[1:]
    while hasattr(command, "commands"):
        command = command.commands[arguments.pop(0)]
    command.make_context(line, arguments, resilient_parsing=True)  # raises for unknown options


def test_the_trial_is_that_of_the_page_on_recording():
    (trial,) = (text for kind, text in BLOCKS if kind == "yaml")
    assert trial in (ROOT / "docs/recording.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_paths_without_hardware(tmp_path):
    """Each project is new; the recordings are those of the example program."""
    command = str(Path(sys.executable).with_name("ajgdata"))
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    environment.pop("AJGDATA_ROOT", None)

    def printed(*words, cwd):
        done = subprocess.run(
            words, cwd=cwd, env=environment, check=True, text=True, capture_output=True
        )
        return done.stdout.splitlines()

    makes = ROOT / "docs/examples/make_takes.py"
    output = printed(sys.executable, makes, "recordings", cwd=tmp_path)
    folder = tmp_path
    for kind, text in BLOCKS:
        if kind == "yaml":
            (folder / "datasets/trial").mkdir()
            (folder / "datasets/trial/dataset.yaml").write_text(text, encoding="utf-8")
            continue
        for line in text.splitlines() if kind == "sh" else ():
            _, *arguments = shlex.split(line, comments=True) or [""]
            if line == "ajgdata new lab":  # the first or the second path with a project
                folder = tmp_path / f"lab{len(list(tmp_path.glob('lab*')))}"
                output += printed(command, "new", folder.name, cwd=tmp_path)
            elif line.startswith("ajgdata ") and not line.startswith(NOT_RUN):
                output += printed(command, *arguments, cwd=folder)
    shown = [line for kind, text in BLOCKS if kind == "text" for line in text.splitlines()]
    assert [line for line in shown if line not in (*output, "…")] == []
    assert (folder.parent / "lab0/mine.html").is_file()
