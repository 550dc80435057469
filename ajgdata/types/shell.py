"""Command lines that a user can copy into a shell."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterable

#: Texts that cmd and PowerShell pass on as they are.
_PLAIN = re.compile(r"[\w./:\\=-]+")


def shell_quoted(text: str) -> str:
    """Return a text as one argument: of a POSIX shell, or on Windows of PowerShell and cmd.

    >>> shell_quoted("{label}_{grasp}.wav")
    "'{label}_{grasp}.wav'"
    """
    return _quoted_on_windows(text) if sys.platform == "win32" else shlex.quote(text)


def shell_command(arguments: Iterable[str]) -> str:
    """Return the command line of a program and its arguments.

    >>> shell_command(["snakemake", "--config", "datasets=[my data]"])
    "snakemake --config 'datasets=[my data]'"
    """
    return " ".join(shell_quoted(argument) for argument in arguments)


def _quoted_on_windows(text: str) -> str:
    """Return a text in double quotes, unless it is plain.

    A backslash before a double quote would make it a part of the text.
    """
    if _PLAIN.fullmatch(text):
        return text
    text = re.sub(r'(\\*)"', r'\1\1\\"', text)
    text = re.sub(r"(\\+)$", r"\1\1", text)
    return f'"{text}"'
