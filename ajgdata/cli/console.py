"""Standard output and standard error of the commands."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console
from rich.markup import escape

out = Console(emoji=False, highlight=False)
err = Console(stderr=True, emoji=False, highlight=False)


def say(text: str) -> None:
    """Print a line, which may have markup, without wrapping it."""
    out.print(text, soft_wrap=True)


def warn(text: str) -> None:
    """Print a line, which may have markup, to standard error without wrapping it."""
    err.print(text, soft_wrap=True)


def print_facts(facts: Mapping[str, str], width: int = 0) -> None:
    """Print values by topic, in two columns; the first has at least `width` characters."""
    width = max(width, *map(len, facts))
    for topic, value in facts.items():
        say(f"{escape(topic):{width}}  {escape(value)}")
