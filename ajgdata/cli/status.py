"""`ajgdata status`: list outdated results and the reasons. The project is not changed."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import tempfile
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from rich.markup import escape

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import ATTENTION, AllOption, JsonOption, print_json, say, warn
from ajgdata.cli.project import (
    check_console,
    snakemake_command,
    split_arguments,
    utf8_environment,
)
from ajgdata.paths import Paths, find_project
from ajgdata.store.read_only import writable_view
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.types import DataError, many
from ajgdata.types.shell import shell_command

if TYPE_CHECKING:
    from ajgdata.pipeline.outdated import PlannedJob

#: Number of columns of Snakemake's summary: file, date, rule, log files, status, plan.
SUMMARY_COLUMNS = 6
#: Largest number of results of a data set with equal reasons that are printed without `--all`.
MAX_NAMES = 3


class WorkflowStatus(NamedTuple):
    """The rows of `snakemake --summary`, one per result file, and the jobs of a dry run.

    The columns of a row are `output_file`, `date`, `rule`, `log-file(s)`, `status` and `plan`.
    """

    files: list[dict[str, str]]
    jobs: list[PlannedJob]


def status(
    arguments: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]... [OPTION]...",
            help="data sets (default: all), and options of Snakemake",
            autocompletion=dataset_names,
        ),
    ] = None,
    everything: AllOption = False,
    as_json: JsonOption = False,
) -> None:
    """List outdated results and the reasons.

    These are the results of `ajgdata run`, or with names those of `ajgdata run NAME`. Exit code 3
    if a table of a session cannot be used.
    """
    from ajgdata.pipeline.outdated import PlannedJob, grouped, reasons

    paths = find_project()
    names, options = split_arguments(arguments or ())
    state = workflow_status(paths, names, options)
    changes, problems = data_changes(paths, names or list_datasets(paths))
    jobs = [*state.jobs]
    planned = {job.dataset for job in jobs if job.rule == "features"}
    for name, clauses in changes.items():
        if clauses and name not in planned:
            jobs.append(PlannedJob("features", {"dataset": name}, (), (), ""))
    n_missing = sum(row["status"] == "missing" for row in state.files)
    n_pending = sum(row["plan"] != "no update" for row in state.files)
    n_outdated = n_pending - n_missing
    command = ["ajgdata", "run", *names]
    if as_json:
        print_json(
            {
                "datasets": names,
                "command": shell_command(command),
                "n_results": len(state.files),
                "n_outdated": n_outdated,
                "n_missing": n_missing,
                "jobs": [
                    {
                        "dataset": job.dataset or None,
                        "rule": job.rule,
                        "name": job.name,
                        "files": job.outputs,
                        "is_missing": job.is_missing,
                        "reasons": reasons(job, jobs, changes),
                    }
                    for job in jobs
                ],
                "unusable": problems,
            }
        )
        raise typer.Exit(ATTENTION if problems else 0)

    n_results = many(len(state.files), "result file")
    if jobs:
        text = f"{n_outdated} of {n_results} {_are(n_outdated)} outdated"
        if n_missing:
            text += f", {n_missing} {_are(n_missing)} not computed yet"
    else:
        text = f"everything is up to date: {n_results}"
    say(text)
    for dataset, reason, own in grouped(jobs, changes):
        shown = own if everything or len(own) <= MAX_NAMES + 1 else own[:MAX_NAMES]
        n_more = len(own) - len(shown)
        more = f" and {n_more} more (--all shows them)" if n_more else ""
        prefix = f"{dataset}  " if dataset else ""
        say(f"[yellow]{escape(prefix + ', '.join(shown) + more)}[/yellow]: {escape(reason)}")
    if jobs:
        say(f"next: {escape(shell_command(command))}")
    for problem in problems:
        warn(f"[red]unusable[/red] {escape(problem)}")
    raise typer.Exit(ATTENTION if problems else 0)


def _are(count: int) -> str:
    """Return the verb after a number."""
    return "is" if count == 1 else "are"


def data_changes(paths: Paths, names: Sequence[str]) -> tuple[dict[str, list[str]], list[str]]:
    """Return the changes since the features by data set, and one line per unusable table.

    Raises DataError for a table that cannot be read.
    """
    from ajgdata.acquire.recipe import session_names
    from ajgdata.store.freshness import changes_since_features, table_problems

    changes = {}
    problems = []
    for name in names:
        spec = read_dataset(paths, name)
        simulated_sessions = session_names(spec.recipe)
        changes[name] = changes_since_features(paths, spec, simulated_sessions)
        problems += [str(error) for error in table_problems(paths, name, simulated_sessions)]
    return changes, problems


def workflow_status(
    paths: Paths, names: Sequence[str], options: Sequence[str] = ()
) -> WorkflowStatus:
    """Return the state of the results of data sets, and the jobs that Snakemake would run.

    `options` are other arguments of Snakemake. The project is not changed, and it may be read-only.
    Raises DataError with Snakemake's message.
    """
    check_console()
    command = [sys.executable, "-m", *snakemake_command(paths, names, options)]
    command += ["--dry-run", "--logger", "job-lines"]
    with writable_view(paths.root) as folder, tempfile.TemporaryDirectory() as temporary:
        plan = Path(temporary) / "plan.jsonl"
        command += ["--directory", str(folder)]
        commands = ([*command, "--summary"], [*command, "--logger-job-lines-plan", str(plan)])
        with ThreadPoolExecutor() as pool:
            summary, _ = pool.map(lambda words: _printed(paths, words), commands)
        lines = plan.read_text(encoding="utf-8").splitlines() if plan.exists() else []
    table = (line for line in summary.splitlines() if line.count("\t") == SUMMARY_COLUMNS - 1)
    files = list(csv.DictReader(table, delimiter="\t"))
    missing = {row["output_file"] for row in files if row["status"] == "missing"}
    jobs = [_planned_job(json.loads(line), missing) for line in lines]
    return WorkflowStatus(files, [job for job in jobs if job.outputs])


def _planned_job(fields: Mapping[str, Any], missing: Collection[str]) -> PlannedJob:
    """Return a job of the plan of a dry run. `missing` are all files that do not exist."""
    from ajgdata.pipeline.outdated import PlannedJob, files_in

    outputs = files_in(fields["output"])
    return PlannedJob(
        rule=fields["rule_name"],
        wildcards=dict(fields["wildcards"]),
        outputs=outputs,
        missing=tuple(file for file in outputs if file in missing),
        reason=fields["reason"],
    )


def _printed(paths: Paths, command: Sequence[str]) -> str:
    """Return what a command of Snakemake prints. Raises DataError with its message."""
    process = subprocess.run(
        command,
        check=False,
        cwd=paths.root,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,  # dry runs print errors to standard output, others do not
        encoding="utf-8",
        env=utf8_environment(),
    )
    if process.returncode:
        lines = [line for line in process.stdout.splitlines() if line.strip()]
        problem = lines[-1].strip(" .") if lines else "snakemake stopped without a message"
        raise DataError(paths.root, problem, "run `snakemake --dry-run` for details")
    return process.stdout
