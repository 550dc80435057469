"""What is wrong with a declaration or a setting is said in one line, without a traceback."""

import pytest
from conftest import ROOT, snakemake_here


def complaint(capsys, root, *arguments):
    """The text that Python prints for a SystemExit, which is all that is said."""
    call = ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(root), "--dry-run"]
    line = snakemake_here(*call, "--quiet", "all", *arguments)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if not line.startswith(("Using", "Config"))] == []
    return line


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("name: d\ntitel: x\n", "unknown key titel; correct its spelling or remove it"),
        ("name: d\n", "no data set here has recordings or a recipe; get some with"),
    ],
)
def test_a_declaration(tmp_path, capsys, content, said):
    path = tmp_path / "datasets/d/dataset.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(content)
    line = complaint(capsys, tmp_path)
    assert said in line and "\n" not in line


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("seed=-1", "config.seed: -1 is less than the minimum of 0; correct it"),
        ("sed=1", "config: Additional properties are not allowed ('sed' was unexpected)"),
        ("datasets=d", "config.datasets: 'd' is not of type 'array', 'null'; correct it"),
    ],
)
def test_a_setting(tmp_path, capsys, setting, said):
    line = complaint(capsys, tmp_path, "--config", setting)
    assert line.startswith(said) and "\n" not in line
