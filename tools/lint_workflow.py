"""`python -m tools.lint_workflow`: Snakemake's lints of the workflow, except one.

The rules name no conda environment: Snakemake itself imports the package, so one environment holds
both (docs/decisions.md). Exit code 1 if there is any other lint.
"""

from __future__ import annotations

import re
import subprocess
import sys

NOT_APPLICABLE = "Specify a conda environment or container for each rule."


def other_lints(text: str) -> list[str]:
    """Return the titles of the lints in Snakemake's output that apply to this workflow.

    >>> other_lints("Lints for rule a (line 3, a.smk):\\n    * No log directive defined:\\n")
    ['No log directive defined']
    """
    titles = re.findall(r"^ {4}\* (.+):$", text, re.M)
    return [title for title in titles if title != NOT_APPLICABLE]


def main() -> None:
    """Lint the workflow of this folder."""
    command = [sys.executable, "-m", "snakemake", "--lint"]
    result = subprocess.run(command, check=False, capture_output=True, text=True)
    text = result.stdout + result.stderr
    if "Lints for" not in text and result.returncode:
        sys.exit(text)  # the workflow cannot be read
    if other_lints(text):
        sys.exit(text)


if __name__ == "__main__":
    main()
