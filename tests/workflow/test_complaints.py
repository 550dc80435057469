"""What is wrong with a declaration or a setting is said in one line, without a traceback."""

import subprocess
import sys

import pytest
from conftest import ROOT


def complaint(root, *arguments):
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile")]
    command += ["--directory", str(root), "--dry-run", "--quiet", "all", *arguments]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 1
    said = [line for line in done.stderr.splitlines() if not line.startswith(("Using", "Config"))]
    return [line for line in said if line]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("name: d\ntitel: x\n", "unknown key titel; correct its spelling or remove it"),
        ("name: d\n", "no data set here has recordings or a recipe; get some with"),
    ],
)
def test_a_declaration(tmp_path, content, said):
    path = tmp_path / "datasets/d/dataset.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(content)
    (line,) = complaint(tmp_path)
    assert said in line


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("seed=-1", "config.seed: -1 is less than the minimum of 0; correct it"),
        ("sed=1", "config: Additional properties are not allowed ('sed' was unexpected)"),
        ("datasets=d", "config.datasets: 'd' is not of type 'array', 'null'; correct it"),
    ],
)
def test_a_setting(tmp_path, setting, said):
    (line,) = complaint(tmp_path, "--config", setting)
    assert line.startswith(said)
