"""Completion by the tab key: the script for a shell, commands, options and names of data sets."""

import pytest
from typer.testing import CliRunner

from ajgdata.cli import app
from ajgdata.cli.main import PANELS

RUN = CliRunner()


@pytest.fixture
def completions(project, monkeypatch):
    """Return what bash proposes for the last word of a line."""
    monkeypatch.chdir(project.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)

    def complete(*words: str) -> list[str]:
        line = " ".join(("ajgdata", *words))
        shell = {"_AJGDATA_COMPLETE": "complete_bash", "COMP_WORDS": line}
        count = {"COMP_CWORD": str(len(words))}
        return RUN.invoke(app, env=shell | count, prog_name="ajgdata").stdout.split()

    return complete


def test_the_script_for_a_shell_is_printed(monkeypatch):
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    done = RUN.invoke(app, ["--show-completion", "bash"], prog_name="ajgdata")
    assert done.exit_code == 0
    assert "_AJGDATA_COMPLETE=complete_bash" in done.stdout
    assert done.stdout.rstrip().endswith("complete -o default -F _ajgdata_completion ajgdata")


def test_commands_and_options_are_completed(completions):
    names = [command.__name__ for commands in PANELS.values() for command in commands]
    proposed = completions("")
    assert {name.removesuffix("_command") for name in names} | {"device"} == set(proposed)
    assert completions("che") == ["check"]
    assert completions("check", "--js") == ["--json"]


@pytest.mark.parametrize("command", ["check", "run", "status", "simulate", "publish", "plan"])
def test_data_sets_of_the_project_are_completed(completions, project, command):
    for name in ("size", "size_small", "ycb"):
        file = project.paths.dataset(name)
        file.parent.mkdir()
        file.touch()
    assert completions(command, "si") == ["size", "size_small"]
    assert completions(command, "") == ["d", "size", "size_small", "ycb"]


def test_additional_names_and_the_value_of_an_option_are_completed(completions):
    assert completions("check", "d", "") == ["d"]
    assert completions("import", "folder", "--dataset", "") == ["d"]


def test_outside_a_project_no_name_is_proposed(completions, monkeypatch):
    monkeypatch.chdir("/")
    assert completions("check", "") == []
