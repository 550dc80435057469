"""Standard output and standard error of the commands."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping

from rich.console import Console
from rich.markup import escape

#: Lines with one reason that are shown unless all are requested.
MAX_SHOWN = 5
#: Exit code of a command that did its work, with a result that needs attention.
ATTENTION = 3
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


def shortened(lines: Iterable[tuple[str, str]], *, everything: bool) -> Iterator[tuple[str, str]]:
    """Yield names and reasons, grouped; up to MAX_SHOWN names per reason, unless `everything`."""
    names: dict[str, list[str]] = defaultdict(list)
    for name, reason in lines:
        names[reason].append(name)
    for reason, equal in names.items():
        shown = equal if everything or len(equal) <= MAX_SHOWN + 1 else equal[:MAX_SHOWN]
        yield from ((name, reason) for name in shown)
        if remaining := len(equal) - len(shown):
            yield f"and {remaining} more", f"{reason} (--all shows them)"
