"""Findings and files left out, as lines: the first few of a kind, then how many more there are."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

from rich.cells import cell_len, set_cell_size
from rich.console import Console

from ajgdata.types import Finding

#: Lines of one kind that are shown unless all are asked for.
SHOWN = 5
_ORDER = ("error", "warning", "note")
out = Console(emoji=False, highlight=False)


def print_findings(findings: Sequence[Finding], *, everything: bool) -> None:
    """Print a table with one line for each finding, however wide the terminal is.

    Errors come first, and of one kind (level, code and fix) no more than SHOWN lines unless
    `everything`.
    """
    kinds: dict[tuple[str, str, str], list[Finding]] = defaultdict(list)
    for one in sorted(findings, key=lambda f: _ORDER.index(f.level)):
        kinds[one.level, one.code, one.fix].append(one)
    rows = [("recording", "level", "what", "problem", "fix")]
    for (level, code, _), found in kinds.items():
        some = found if everything or len(found) <= SHOWN + 1 else found[:SHOWN]
        rows += [
            (f"{one.session_id}/{one.recording_id}", level, code, one.problem, one.fix)
            for one in some
        ]
        if more := len(found) - len(some):
            rows.append(
                (f"and {more} more", level, code, "like the ones above", "--all shows them")
            )
    widths = [max(cell_len(row[column]) for row in rows) for column in range(4)]
    for *cells, fix in rows:
        padded = (set_cell_size(cell, width) for cell, width in zip(cells, widths, strict=True))
        out.out("  ".join([*padded, fix]))
    counts: dict[str, int] = defaultdict(int)
    for one in findings:
        counts[one.code] += 1
    most = sorted(counts, key=lambda code: -counts[code])
    out.out("\n" + ", ".join(f"{code} {counts[code]}" for code in most))


def grouped(named: Sequence[tuple[str, str]], *, everything: bool) -> Iterator[str]:
    """Yield a line for each name and reason; of one reason no more than SHOWN unless all."""
    names: dict[str, list[str]] = defaultdict(list)
    for name, reason in named:
        names[reason].append(name)
    for reason, found in names.items():
        some = found if everything or len(found) <= SHOWN + 1 else found[:SHOWN]
        for name in some:
            yield f"{name}: {reason}"
        if more := len(found) - len(some):
            yield f"and {more} more ({reason}); --all shows them"
