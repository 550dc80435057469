"""Which tests the workflow runs."""

from ajgdata.pipeline.verify import verify_solver

PYTEST = "[tool.pytest.ini_options]\nmarkers = ['slow: minutes']\n"
PASSES = "import pytest\n@pytest.mark.slow\ndef test_it():\n    pass\ndef test_other():\n    pass\n"
FAILS = "import pytest\n@pytest.mark.slow\ndef test_it():\n    assert False\n"


def test_long_checks_of_the_solver_are_those_of_the_solver(tmp_path):
    (tmp_path / "pyproject.toml").write_text(PYTEST)
    for folder, test in {"verification": PASSES, "unit": FAILS}.items():
        (tmp_path / "tests" / folder).mkdir(parents=True)
        (tmp_path / "tests" / folder / f"test_{folder}.py").write_text(test)
    summary = tmp_path / "solver.txt"
    verify_solver(
        tmp_path / "tests/verification/test_verification.py", summary, log=tmp_path / "solver.log"
    )
    assert summary.read_text().startswith("1 passed, 1 deselected")
