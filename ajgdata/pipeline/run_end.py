"""End of a run: its summary on the console, and its exit code. Light: Snakemake imports this."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

#: The summary of a run that skipped tasks, or could not read recordings or requested results, ends
#: with a line that begins with this.
INCOMPLETE = "incomplete:"


def end_run(summaries: Mapping[Path, int], changed: Iterable[str] = ()) -> None:
    """Print the summary that this run wrote, if any; `summaries` are possible ones with their time
    before the run.

    A run that skipped tasks, or could not read recordings, ends with one line and exit code 1. Its
    summary is removed, so that the next run reports them again. A run during which tables of data
    sets changed ends with exit code 1 and one line for each data set (`changed`); the next run
    computes its results again.
    """
    last = ""
    for summary, before in summaries.items():
        if modified_ns(summary) in (0, before):
            continue
        text = summary.read_text(encoding="utf-8")
        *_, line = text.splitlines()
        if line.startswith(INCOMPLETE):
            text, last = text.removesuffix(f"{line}\n"), line
            summary.unlink()
        print(f"\n{text}", end="", flush=True)
    lines = [f"{INCOMPLETE} {line}" for line in changed]
    if last:
        lines.append(last)
    if lines:
        raise SystemExit("\n".join(lines))


def modified_ns(path: Path) -> int:
    """Return when a file was written, in ns; 0 if it does not exist."""
    return path.stat().st_mtime_ns if path.is_file() else 0
