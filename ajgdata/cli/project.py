"""Commands that call Snakemake (`run`, `simulate`, `status`), and `ajgdata doctor`."""

from __future__ import annotations

import csv
import os
import platform
import shlex
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from typing import Annotated, NoReturn

import typer
from rich.markup import escape

from ajgdata.cli.console import ATTENTION, print_facts, say, warn
from ajgdata.paths import Paths, find_project
from ajgdata.types import DataError

GB = 1e9
#: Snakemake's options that set a configuration.
CONFIG = ("--config", "-C")
#: Columns of Snakemake's summary: file, date, rule, log files, status, plan.
SUMMARY_COLUMNS = 6


def doctor() -> None:
    """Print diagnostics for a bug report."""
    try:
        paths = find_project()
    except FileNotFoundError:
        paths = None
    print_facts(diagnostics(paths))


def diagnostics(paths: Paths | None) -> dict[str, str]:
    """Return versions and resources by topic; outside a project `paths` is None."""
    import h5py
    import soundfile

    from ajgdata.store.provenance import environment, software

    versions, packages = software(), environment()["packages"]
    libraries = {"HDF5": h5py.version.hdf5_version, "libsndfile": soundfile.__libsndfile_version__}
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    free = shutil.disk_usage(paths.root if paths else Path.cwd()).free
    return {
        "ajgdata": f"{versions['ajgdata_version']}, commit {versions['git_commit'] or 'unknown'}",
        "python": f"{platform.python_version()} ({sys.executable})",
        "system": f"{platform.platform()}, {platform.machine()}",
        "packages": ", ".join(f"{n} {version}" for n, version in (packages | libraries).items()),
        "resources": f"{os.cpu_count()} cores, {memory / GB:.1f} GB of memory, "
        f"{free / GB:.1f} GB of disk space free",
        "project": str(paths.root) if paths else "none here or above",
    }


def status(
    arguments: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME]... [OPTION]...", help="data sets, and options of Snakemake"),
    ] = None,
) -> None:
    """List outdated results and the reasons.

    Exit code 3 if a table of a session cannot be used.
    """
    from ajgdata.store.sessions import list_datasets

    paths = find_project()
    names, options = split_arguments(arguments or ())
    target = [] if names else ["everything"]
    results = workflow_status(paths, [*target, *with_datasets(names, options)])
    outdated = Counter(
        # Snakemake's status is "ok" if only an input will be written again.
        (row["rule"], row["status"].replace("ok", "outdated inputs"))
        for row in reversed(results)  # Snakemake begins with the last job
        if row["plan"] != "no update"
    )
    for (rule, reason), count in outdated.items():
        say(f"[yellow]{rule}[/yellow] would write {count} files ({escape(reason)})")
    changes, problems = data_changes(paths, names or list_datasets(paths))
    for line in changes:
        say(f"[yellow]features[/yellow] {escape(line)}")
    say(f"{len(results) - outdated.total()} results are current, {outdated.total()} are not")
    for problem in problems:
        warn(f"[red]unusable[/red] {escape(problem)}")
    raise typer.Exit(ATTENTION if problems else 0)


def data_changes(paths: Paths, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return lines on outdated features, and lines on tables of sessions that cannot be used.

    Raises DataError for a table that cannot be read.
    """
    from ajgdata.acquire.recipe import session_names
    from ajgdata.store.freshness import changes_since_features, table_problems
    from ajgdata.store.sessions import read_dataset

    changes, problems = [], []
    for name in names:
        spec = read_dataset(paths, name)
        virtual = session_names(spec.recipe)
        reasons = changes_since_features(paths, spec, virtual)
        if reasons:
            changes.append(f"of {name} are outdated: {', '.join(reasons)}")
        problems += [str(error) for error in table_problems(paths, name, virtual)]
    return changes, problems


def workflow_status(paths: Paths, options: Sequence[str] = ()) -> list[dict[str, str]]:
    """Return the rows of Snakemake's summary, one per result, see SUMMARY_COLUMNS.

    `snakemake --summary` prints them, with the arguments `options`; as a dry run it writes no log.
    The project need not be writable.
    Raises DataError with Snakemake's message.
    """
    from ajgdata.store.read_only import writable_view

    command = [sys.executable, "-m", "snakemake", "--snakefile", str(snakefile_of(paths))]
    both = subprocess.STDOUT  # a dry run prints to one stream what other runs print to the other
    with writable_view(paths.root) as folder:
        command += ["--directory", str(folder), "--summary", "--dry-run", *options]
        done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=both, text=True)
    lines = [line for line in done.stdout.splitlines() if line.strip()]
    if done.returncode:
        problem = lines[-1].strip(" .") if lines else "snakemake stopped without a message"
        raise DataError(paths.root, problem, "run `snakemake --dry-run` for details")
    table = (line for line in lines if line.count("\t") == SUMMARY_COLUMNS - 1)
    return list(csv.DictReader(table, delimiter="\t"))


Arguments = Annotated[
    list[str],
    typer.Argument(
        metavar="NAME... [OPTION]...", help="data sets, and options of Snakemake, e.g. --dry-run"
    ),
]


def run(arguments: Arguments) -> None:
    """Run the pipeline for selected data sets.

    Computes features, models, experiments and the report. Prints the equivalent `snakemake`
    command first, and a summary at the end. Exit code 1 if a task was skipped that is not declared
    optional, if recordings or requested results could not be read, or if tables changed during the
    run.
    """
    from ajgdata.store.sessions import read_dataset

    paths = find_project()
    names, options = split_arguments(arguments)
    for name in names or arguments[:1]:
        read_dataset(paths, name)  # raises DataError for an unknown data set
    _snakemake(paths, names, options)


def simulate(arguments: Arguments) -> None:
    """Record the recipes of data sets with the virtual gripper.

    `ajgdata run` records and evaluates. Prints the equivalent `snakemake` command first.
    """
    from ajgdata.acquire.recipe import session_names
    from ajgdata.store.sessions import read_dataset

    paths = find_project()
    names, options = split_arguments(arguments)
    targets = []
    for name in names or arguments[:1]:
        if not (recipe := read_dataset(paths, name).recipe):
            fix = "use `ajgdata record` or `ajgdata import`"
            raise DataError(paths.dataset(name), "has no recipe", fix)
        sessions = [paths.acquired(name, session) for session in session_names(recipe)]
        targets += [str(path.relative_to(paths.root)) for path in sessions]
    _snakemake(paths, names, options, targets)


def _snakemake(
    paths: Paths, names: Sequence[str], options: Sequence[str], targets: Sequence[str] = ()
) -> NoReturn:
    """Print and run Snakemake for data sets, and exit with its exit code."""
    words = snakemake_command(paths, names, [*targets, *options])
    print(shlex.join(words), flush=True)
    done = subprocess.run([sys.executable, "-m", *words], check=False, cwd=paths.root)
    raise typer.Exit(done.returncode)


def split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names of data sets, which come first, and the options for Snakemake."""
    names = list(takewhile(lambda text: not text.startswith("-"), arguments))
    return names, list(arguments[len(names) :])


def with_datasets(names: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return Snakemake's options, limited to the data sets `names`: their features, tasks, models
    and a report of their own.

    Raises DataError for a second `--config`, because Snakemake uses only the last one.
    """
    if not names:
        return list(options)
    if any(text.split("=")[0] in CONFIG for text in options):
        problem = "is already used to choose the data sets"
        raise DataError("--config", problem, "call snakemake with your own --config")
    chosen = f"datasets=[{','.join(names)}]"
    return [*options, "--config", chosen, "alone=True", "pages=[]", "publish=[]"]


def snakefile_of(paths: Paths) -> Path:
    """Return the workflow: the project's own, else that of the source of the package.

    Raises DataError if there is neither: an installed package has no workflow.
    """
    from ajgdata.store.provenance import PACKAGE

    for file in (paths.snakefile, PACKAGE.parent / paths.snakefile.name):
        if file.is_file():
            return file
    problem = "there is no workflow here, and none came with the installed package"
    fix = "work in a copy of the source (git clone), or put its Snakefile and workflow/ here"
    raise DataError(paths.snakefile, problem, fix)


def snakemake_command(paths: Paths, names: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return the equivalent `snakemake` command, to be given in the project's folder."""
    workflow = snakefile_of(paths)
    place = [] if workflow == paths.snakefile else ["--snakefile", str(workflow)]
    return ["snakemake", *place, *with_datasets(names, options)]
