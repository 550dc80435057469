"""Every command and code block of the README runs, in order, in an empty clone."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tools.address import project_urls

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(sh|python|text)\n(.*?)^```", TEXT, flags=re.M | re.S)
#: The two long commands, and their quick forms: one feature file, one folder of tests.
QUICK = {
    "make reproduce": "make reproduce ARGS=results/features/size.nc",
    "make test": "make test ARGS='-n 0 tests/contract/test_catalogue.py'",
    "ajgdata run": "ajgdata run --dry-run",
    # A test of the extras installs the wheel in an empty environment.
    'pip install "ajgdata[workflow]"': "ajgdata --version",
    'pip install "ajgdata[all]"': "ajgdata --version",
}
#: A folder of WAV files, which a user has already.
RECORDINGS = "python docs/examples/make_takes.py recordings"


def link_environment(prefix: str) -> list[str]:
    """Return commands that make this environment the clone's own, newer than its lock file."""
    linked = [f"ln -s '{prefix}/{name}' .venv/{name}" for name in ("bin", "lib", "pyvenv.cfg")]
    return [
        "mkdir .venv",
        *linked,
        "touch -d 2000-01-01 requirements.lock pyproject.toml tools/bootstrap.sh",
        "touch .venv/.test",
        'export PYTHONPATH="$PWD"',
    ]


def shell_lines(block: str) -> list[str]:
    """Return the commands of a shell block as the test runs them."""
    lines = [line.partition("  #")[0].rstrip() for line in block.splitlines()]
    source = project_urls(ROOT)["Source"]
    lines = [
        QUICK.get(line, line).replace(f"clone {source} ", f"clone '{ROOT}' ") for line in lines
    ]
    at = lines.index("cd ajgdata") + 1 if "cd ajgdata" in lines else 0
    return [*lines[:at], *link_environment(sys.prefix), *lines[at:]] if at else lines


#: Commands in the running text: a dry run of each shows that its target exists.
INLINE = [f"{command} -n" for command in re.findall(r"`(snakemake[^`]*)`", TEXT)]
INLINE += [f"{command} ARGS=-n" for command in re.findall(r"`(make (?!test)[^`]*)`", TEXT)]


def script() -> str:
    """Return all blocks as one shell script."""
    parts = ["set -e"]
    for kind, block in BLOCKS:
        if kind == "python":
            parts += [f"cat > block.py <<'END'\n{block}END", "python block.py"]
        elif kind == "sh":
            parts += [RECORDINGS] if "ajgdata import" in block else []
            parts += shell_lines(block)
            parts.append('clone="${clone-$PWD}"; cd "$clone"')
    parts += sorted(set(INLINE))
    return "\n".join(parts)


@pytest.mark.slow
def test_every_block_runs_in_an_empty_clone(tmp_path):
    if not (ROOT / ".git").exists() or not (Path(sys.prefix) / "bin" / "activate").exists():
        pytest.skip("needs a clone and its .venv")
    changed = {"PYTHONPATH", "AJGDATA_ROOT", "VIRTUAL_ENV", "MAKEFLAGS"}
    environment = {k: v for k, v in os.environ.items() if k not in changed}
    result = subprocess.run(
        ["bash", "-c", script()],
        cwd=tmp_path,
        env=environment | {"MPLBACKEND": "agg"},
        check=False,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    assert result.returncode == 0, result.stdout
    expected = [line for kind, block in BLOCKS if kind == "text" for line in block.splitlines()]
    assert [line for line in expected if line not in result.stdout.splitlines()] == []
    clone = tmp_path / "ajgdata"
    assert (clone / "spectra.png").stat().st_size > 10_000
    assert (clone / "lab/results/runs/mine/report/index.html").is_file()


def test_commands_of_the_readme_are_the_tested_commands():
    assert [kind for kind, _ in BLOCKS] == ["sh", "sh", "python", "sh", "text"]
    assert len(re.findall(r"^```", TEXT, flags=re.M)) == 2 * len(BLOCKS)
    commands = [line.partition("  #")[0].rstrip() for line in BLOCKS[0][1].splitlines()]
    assert {"make reproduce", "make test"} < set(commands)
    assert {"snakemake everything -n", "make everything ARGS=-n"} <= set(INLINE)
    code = "".join(block for _, block in BLOCKS)
    inline = {c.split()[1] for c in re.findall(r"`(ajgdata [a-z]+[^`]*)`", TEXT)}
    assert [name for name in inline if f"ajgdata {name}" not in code] == []
