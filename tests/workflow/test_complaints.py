"""What is wrong with a declaration or a setting is said in one line, without a traceback."""

import pytest
from conftest import ROOT, snakemake_here


def complaint(capsys, root, *arguments):
    """The text that Python prints for a SystemExit, which is all that is said."""
    call = ["--snakefile", str(ROOT / "workflow/Snakefile"), "--directory", str(root), "--dry-run"]
    line = snakemake_here(*call, "--quiet", "all", *arguments)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if not line.startswith(("Using", "Config"))] == []
    return line


@pytest.mark.parametrize(
    ("content", "setting", "text"),
    [
        ("name: d\ntitel: x\n", "seed=1", "unknown key titel. Correct its spelling or remove it"),
        ("name: d\n", "seed=1", "no data set here has recordings or a recipe. Get some with"),
        ("name: d\n", "seed=-1", "config.seed: -1 is less than the minimum of 0. Correct it."),
        ("name: d\n", "device=gpu", "config.device: 'gpu' is not one of ['auto', 'cpu', 'cuda']"),
        ("name: d\n", "sed=1", "config: Additional properties are not allowed ('sed' was unexpec"),
        ("name: d\n", "datasets=d", "config.datasets: 'd' is not of type 'array', 'null'. Correct"),
    ],
)
def test_a_mistake_is_one_line(tmp_path, capsys, content, setting, text):
    path = tmp_path / "datasets/d/dataset.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(content)
    line = complaint(capsys, tmp_path, "--config", setting)
    assert text in line and "\n" not in line
