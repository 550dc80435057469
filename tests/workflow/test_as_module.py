"""Other workflows import this one as a module, under names of their own."""

import subprocess
import sys

import pytest
import yaml
from conftest import DECLARATION, ROOT

SNAKEFILE = f"""
configfile: "settings.yaml"


module ajg:
    snakefile:
        "{ROOT / "workflow/Snakefile"}"
    config:
        config


use rule * from ajg as ajg_*


rule summary:
    default_target: True
    input:
        rules.ajg_report.output.page,
        rules.ajg_report.output.runs,
    output:
        "summary.txt",
    log:
        "summary.log",
    shell:
        "wc -c {{input}} > {{output}} 2> {{log}}"
"""
#: The script of all experiments is run here.
MORE = {"experiments": {"learning_curve": {"groups": [2, 4], "repeats": 2, "models": ["knn"]}}}


@pytest.mark.slow
def test_the_workflow_runs_as_a_module_with_a_prefix(project):
    task = DECLARATION["tasks"]["pitch"] | MORE
    project.paths.dataset("tones").write_text(
        yaml.safe_dump(DECLARATION | {"tasks": {"pitch": task}})
    )
    (project.root / "Snakefile").write_text(SNAKEFILE)
    command = [sys.executable, "-m", "snakemake", "--cores", "2"]

    def run(*arguments):
        done = subprocess.run(
            [*command, *arguments], cwd=project.root, check=False, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    planned = run("--dry-run")
    for rule in ("experiment", "report"):
        assert f"\najg_{rule} " in planned
    run()
    assert "results/report/index.html" in (project.root / "summary.txt").read_text()
    assert project.paths.experiment("tones", "pitch", "learning_curve", "plain").is_file()
    assert "Nothing to be done" in run("--dry-run")
