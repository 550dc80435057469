"""What a run tells at its end, and when its exit code says that something is wanting."""

from pathlib import Path

import pytest
from experiment_samples import small_store

from ajgdata.cli.project import snakemake_command as command
from ajgdata.cli.project import split_arguments
from ajgdata.paths import Paths, run_name
from ajgdata.pipeline.run_end import end_run
from ajgdata.pipeline.run_summary import complete, run_cost
from ajgdata.store.benchmarks import cost_text
from ajgdata.store.features import write_store
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.findings import write_findings
from ajgdata.store.models import write_about
from ajgdata.types import DataError, Finding

ROOT = Path(__file__).parents[2]
MEASUREMENTS = (("cross_validation", "cnn"), ("cross_validation", "my-model"), ("energy", ""))


@pytest.fixture
def paths(tmp_path, monkeypatch) -> Paths:
    """A data set with two recordings left out, and two tasks: of `t` one of three is there."""
    monkeypatch.setattr("ajgdata.pipeline.run_summary.machine_line", lambda: "machine: fast")
    folders = Paths(tmp_path)
    write_store(folders.features("d"), small_store())
    finding = Finding("s", "1", "", "error", "silent", "p", "f")
    findings = [finding, Finding("s", "1", "", "error", "short", "p", "f")]
    findings += [Finding("s", "2", "", "warning", "copy", "p", "f")]
    findings += [Finding("s", "3", "", "warning", "quiet", "p", "f")]  # used all the same
    write_findings(folders.quarantine("d"), findings)
    lacks = {"skipped": "one class only"}
    results = [
        {
            **{"dataset": "d", "task": task, "experiment": experiment, "model": model},
            **(lacks if task == "t" and model else {"left_out": {"rare": 1}}),
        }
        for task in ("t", "u")
        for experiment, model in MEASUREMENTS
    ]
    about = {
        "agreements": {"agrees": 3, "worse": 2},
        "answer": ["A.", "B."],
        "placebo": "",
        "cost": "",
        "unreadable": {},
    }
    write_bytes(folders.runs, json_bytes({**about, "measurements": results}))
    write_about(folders.model("d", "t", "cnn"), {"skipped": "one class only"})
    return folders


def summary(paths, optional=("d/x",), files=()) -> list[str]:
    requested = [("d", task, *names) for task in ("t", "u") for names in MEASUREMENTS]
    complete(paths, ["d"], requested, [("d", "t", "cnn")], optional, files, paths.complete)
    return paths.complete.read_text().splitlines()


def test_everything_that_a_person_needs_to_know(paths):
    for job, memory in (
        ("experiment/d/t/x.y", 100),
        ("experiment/other/t/x.y", 900),
        ("collect", 10),
    ):
        file = paths.benchmarks / f"{job}.tsv"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"s\tcpu_time\tmax_rss\tmax_pss\n60\t30\t{memory}\t{memory}\n")
    write_bytes(paths.dataset("other"), b"name: other\n")
    about = read_json(paths.runs) | {"cost": cost_text(run_cost(paths, ["d"])[-1])}
    write_bytes(paths.runs, json_bytes(about))
    assert summary(paths)[:-1] == [
        f"left out  2 recordings: {paths.quarantine('d')}",
        "left out  classes of d/t with fewer groups than min_groups: rare",
        "left out  classes of d/u with fewer groups than min_groups: rare",
        "skipped   d/t, cross_validation of cnn, cross_validation of my-model, training of cnn: "
        "one class only",
        "A.",
        "B.",
        "comparison with the paper: 3 agree, 2 worse",
        "recordings with issues: 1 error, 2 warnings, 0 notes",
        "1 data set: 60 recordings used",
        "6 measurements: 4 made, 2 skipped (d/t; reasons above)",
        f"report: {paths.report}",
        "cost without final models: 2 jobs, 2.0 min wall time, 1.0 min CPU time, "
        "peak memory 105 MB",
        "machine: fast",
    ]


def test_a_run_that_skipped_a_task_ends_with_a_line_and_reports_it_again(paths, capsys):
    summary(paths)
    with pytest.raises(SystemExit, match=r"^incomplete: d/t skipped \(reasons above\)"):
        end_run({paths.complete: 0, paths.everything: 0})
    assert not paths.complete.exists()
    said = capsys.readouterr().out
    assert "skipped   d/t, cross_validation of cnn" in said and "incomplete" not in said


def test_a_requested_result_that_cannot_be_read_changes_the_exit_code(paths):
    """A result of another target is only listed."""
    own = paths.study("accuracy")
    other = paths.study("verification")
    errors = {str(file): f"{file}: format 2 is of an earlier version" for file in (own, other)}
    write_bytes(paths.runs, json_bytes(read_json(paths.runs) | {"unreadable": errors}))
    lines = summary(paths, optional=["d/t"], files=[own])
    assert lines[:2] == [f"left out  {error}" for error in errors.values()]
    assert lines[-1] == "incomplete: 1 result could not be read (reasons above)"
    assert summary(paths, optional=["d/t"])[-1] == "machine: fast"


def test_a_model_of_another_version_changes_the_exit_code(paths):
    file = paths.model("d", "t", "cnn") / "model.json"
    write_bytes(file, json_bytes({"format": 99}))
    lines = summary(paths, optional=["d/t"])
    assert lines[0].startswith(f"left out  {file}: format 99 is of a later version of ajgdata")
    assert lines[0].endswith(
        ". Run `ajgdata train d t --model cnn --force`, which computes it again."
    )
    assert lines[-1] == "incomplete: 1 result could not be read (reasons above)"


def test_a_run_of_some_data_sets_is_a_command_that_a_person_could_give(tmp_path):
    paths = Paths(tmp_path)
    paths.profile.parent.mkdir(parents=True)
    for file in (paths.snakefile, paths.profile):
        file.touch()
    assert split_arguments(["a", "b", "--cores", "2"]) == (["a", "b"], ["--cores", "2"])
    assert command(paths, ["a", "b"], ["-n"]) == [
        "snakemake",
        "-n",
        "--config",
        "datasets=[a,b]",
        "alone=True",
        "pages=[]",
        "publish=[]",
    ]
    assert command(paths, [], ["--config", "quick=True"])[1:] == ["--config", "quick=True"]
    for given in (["--config", "quick=True"], ["--config=quick=True"], ["-C", "quick=True"]):
        with pytest.raises(DataError, match="Call snakemake with your own --config"):
            command(paths, ["a"], given)
    paths.snakefile.unlink()
    paths.profile.unlink()
    _, *options = command(paths, [], [])
    assert options[::2] == ["--snakefile", "--workflow-profile"]
    assert [Path(given).relative_to(ROOT).as_posix() for given in options[1::2]] == [
        "workflow/Snakefile",
        "profiles/default",
    ]


def test_a_run_of_some_data_sets_is_named_after_them(tmp_path):
    assert run_name([]) == "" and run_name(["b", "a"]) == run_name(["a", "b"]) == "a+b"
    many = [f"data_set_{n}" for n in range(20)]
    similar = [*many[:-1], "another"]
    assert run_name(many) != run_name(similar)
    assert len(run_name(many)) < 100 and run_name(many).startswith("data_set_0+19~")
    whole = Paths(tmp_path)
    alone = Paths(tmp_path, "a+b")
    together = ("report", "runs", "metrics_table", "predictions")
    for name in (*together, "complete", "opening"):
        own = getattr(alone, name).relative_to(tmp_path / "results/runs/a+b")
        assert own == getattr(whole, name).relative_to(tmp_path / "results")
    of_one = ("features", "quarantine")  # made once, for all runs
    assert all(getattr(alone, name)("a") == getattr(whole, name)("a") for name in of_one)


def test_a_damaged_model_is_listed_and_changes_the_exit_code(paths):
    file = paths.model("d", "t", "cnn") / "model.json"
    for damage in (b"{", b"[]"):
        write_bytes(file, damage)
        lines = summary(paths, optional=["d/t"])
        assert lines[0].startswith(f"left out  {file}")
        assert lines[-1] == "incomplete: 1 result could not be read (reasons above)"
