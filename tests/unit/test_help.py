"""The help of every command: length, form, and one meaning per option name."""

import subprocess
from collections import defaultdict

import typer

from ajgdata.cli import app
from ajgdata.store.models import write_about

GROUP = typer.main.get_command(app)
COMMANDS = {name: command for name, command in GROUP.commands.items() if name != "device"}
COMMANDS |= {
    f"device {name}": command for name, command in GROUP.commands["device"].commands.items()
}
#: Both uses mean the same name: of a session, of an object in the gripper, of a microphone (channel
#: of a file, input of a sound card), of a model, of a task. `--all` lists what is else left out,
#: and with `--yes` a command asks nothing.
TWO_TEXTS = {
    "--all",
    "--microphone",
    "--model",
    "--object",
    "--out",
    "--session",
    "--task",
    "--yes",
}


def test_options_have_a_short_help_and_one_meaning():
    texts = defaultdict(set)
    for name, command in COMMANDS.items():
        for parameter in command.params:
            if parameter.name != "help":
                assert parameter.help, f"{name} {parameter.name}"
                assert len(parameter.help.split()) <= 10, f"{name}: {parameter.help}"
            if parameter.param_type_name == "option":
                texts[parameter.opts[0]].add(parameter.help)
    assert {option for option, helps in texts.items() if len(helps) > 1} == TWO_TEXTS


def test_version(ajgdata):
    code, out, _ = ajgdata("--version")
    assert (code, out.split()[0]) == (0, "ajgdata")


RECIPE = {
    "sessions": 2,
    "grasps_per_object": 1,
    "scene": {"numerics": {"dx_mm": 6}},
    "objects": [{"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}}],
}


def test_simulate_runs_the_sessions_of_a_recipe(ajgdata, project, monkeypatch):
    commands = []

    def run(words, **_):
        commands.append(words[2:])
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(subprocess, "run", run)
    assert "has no recipe. Use `ajgdata record`" in ajgdata("simulate", "d")[2]
    for file in (project.paths.snakefile, project.paths.profile):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    project.declare(recipe=RECIPE)
    assert ajgdata("simulate", "d", "--dry-run")[0] == 0
    sessions = [f"results/acquired/d/virtual-0{number}.done" for number in (1, 2)]
    assert commands[0][:4] == ["snakemake", *sessions, "--dry-run"]
    assert "datasets=[d]" in commands[0]


def test_train_runs_one_job_and_proposes_to_sense(ajgdata, project, monkeypatch):
    commands = []

    def run(words, **_):
        commands.append(words[2:])
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(subprocess, "run", run)
    for file in (project.paths.snakefile, project.paths.profile):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    tasks = {"what": {"target": "object", "models": ["svm", "knn"]}}
    project.declare(targets={"object": {"kind": "classification"}}, tasks=tasks)
    for arguments, problem in (
        (("train", "d", "who"), "there is no task 'who'. Use one of what"),
        (("train", "d", "what", "--model", "kn"), "unknown model 'kn'. Use one of cnn, "),
    ):
        assert problem in ajgdata(*arguments)[2]
    code, out, _ = ajgdata("train", "d", "what", "--model", "knn", "--dry-run")
    assert (code, out.count("\n")) == (0, 1)
    folder = project.paths.model("d", "what", "svm")
    write_about(folder, {})
    code, out, _ = ajgdata("train", "d", "what")
    assert code == 0
    assert out.splitlines()[1].startswith("next: ajgdata sense d what svm --device ")
    assert [words[:3] for words in commands] == [
        ["snakemake", "results/models/d/what/knn", "--dry-run"],
        ["snakemake", "results/models/d/what/svm", "--config"],
    ]
    write_about(folder, {"skipped": "one class only"})
    assert "was not trained: one class only" in ajgdata("train", "d", "what")[2]


def test_scene_draws_an_object_of_a_recipe(ajgdata, project, tmp_path):
    project.declare(recipe=RECIPE)
    assert "has no object 'ball'. Use one of cube" in ajgdata("scene", "d", "ball")[2]
    code, out, _ = ajgdata("scene", "d", "cube", "--out", tmp_path)
    assert code == 0
    assert out.splitlines()[0] == f"{tmp_path}/d-cube.svg"
    assert "simulated" in (tmp_path / "d-cube.svg").read_text()
