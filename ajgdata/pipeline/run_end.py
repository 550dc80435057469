"""End of a run: its summary on the console, and its exit code. Light: Snakemake imports this."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

#: Beginning of the last line of a summary if the run skipped tasks, or could not read recordings or
#: requested results.
INCOMPLETE = "incomplete:"


def end_run(summaries: Mapping[Path, int], changed: Iterable[str] = ()) -> None:
    """Print the summary that this run wrote, and exit with code 1 if the run is incomplete.

    `summaries` are the possible files of the summary, with the time at which each was written
    before the run (see `modified_ns`). If the run skipped tasks or could not read recordings, the
    last line of its summary reports it. This summary is removed, so the next run reports it again.

    `changed` has one line for each data set whose tables changed during the run. The exit code is
    then also 1, and the next run computes its results again.
    """
    incomplete = ""
    for summary, before_ns in summaries.items():
        if modified_ns(summary) in (0, before_ns):
            continue
        text = summary.read_text(encoding="utf-8")
        last_line = text.splitlines()[-1]
        if last_line.startswith(INCOMPLETE):
            incomplete = last_line
            text = text.removesuffix(f"{last_line}\n")
            summary.unlink()
        print(f"\n{text}", end="", flush=True)
    lines = [f"{INCOMPLETE} {line}" for line in changed]
    if incomplete:
        lines.append(incomplete)
    if lines:
        raise SystemExit("\n".join(lines))


def modified_ns(path: Path) -> int:
    """Return the time at which a file was written, in ns; 0 if it does not exist."""
    return path.stat().st_mtime_ns if path.is_file() else 0
