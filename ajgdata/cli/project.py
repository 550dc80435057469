"""Commands on the project: `run` and `simulate`, which call Snakemake, and `doctor`."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from pkgutil import iter_modules
from typing import Annotated

import typer

from ajgdata.cli.completion import dataset_names
from ajgdata.cli.console import print_facts
from ajgdata.paths import SNAKEFILE, Paths, find_project, packaged
from ajgdata.store.provenance import environment, software
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError
from ajgdata.types.extras import extras, missing_packages, require_extra
from ajgdata.types.shell import shell_command

GB = 1e9
#: Options of Snakemake that change the configuration.
CONFIG_OPTIONS = ("--config", "-C")


def doctor() -> None:
    """Print diagnostics for a bug report."""
    try:
        paths = find_project()
    except FileNotFoundError:
        paths = None
    print_facts(diagnostics(paths))


def diagnostics(paths: Paths | None) -> dict[str, str]:
    """Return versions and resources by topic. Outside a project, `paths` is None."""
    import h5py
    import soundfile

    versions = software()
    packages = {
        **environment()["packages"],
        "HDF5": h5py.version.hdf5_version,
        "libsndfile": soundfile.__libsndfile_version__,
    }
    free_gb = shutil.disk_usage(paths.root if paths else Path.cwd()).free / GB
    return {
        "ajgdata": f"{versions['ajgdata_version']}, commit {versions['git_commit'] or 'unknown'}",
        "python": f"{platform.python_version()} ({sys.executable})",
        "system": f"{platform.platform()}, {platform.machine()}",
        "packages": ", ".join(f"{name} {version}" for name, version in packages.items()),
        "extras": ", ".join(name for name in extras() if not missing_packages(name)) or "none",
        "resources": f"{os.cpu_count()} cores, {_memory()}, {free_gb:.1f} GB of disk space free",
        "project": str(paths.root) if paths else "none here or above",
    }


def _memory() -> str:
    """Return the size of the memory. Windows does not report it through `os`."""
    try:
        size_gb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GB
    except (AttributeError, ValueError):
        return "memory unknown"
    return f"{size_gb:.1f} GB of memory"


def run(
    arguments: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]... [OPTION]...",
            help="data sets (default: see above), and options of Snakemake",
            autocompletion=dataset_names,
        ),
    ] = None,
) -> None:
    """Run the pipeline.

    Computes features, models, experiments and the report. Without a name, it computes all data
    sets; if the project has data sets of the paper, only the paper's results. Prints the equivalent
    `snakemake` command first, and a summary at the end. Exit code 1 if a task was skipped that is
    not optional, if recordings or requested results could not be read, or if tables changed during
    the run.
    """
    paths = find_project()
    names, options = split_arguments(arguments or ())
    for name in names:
        read_dataset(paths, name)  # raises DataError for an unknown data set
    raise typer.Exit(run_snakemake(paths, names, options))


def simulate(
    arguments: Annotated[
        list[str],
        typer.Argument(
            metavar="NAME... [OPTION]...",
            help="data sets, and options of Snakemake, e.g. --dry-run",
            autocompletion=dataset_names,
        ),
    ],
) -> None:
    """Record the recipes of data sets with the virtual gripper.

    `ajgdata run` records and evaluates. Prints the equivalent `snakemake` command first.
    """
    from ajgdata.acquire.recipe import session_names

    require_extra("simulate", "ajgdata simulate")
    paths = find_project()
    names, options = split_arguments(arguments)
    targets = []
    for name in names or arguments[:1]:
        recipe = read_dataset(paths, name).recipe
        if recipe is None:
            fix = "use `ajgdata record` or `ajgdata import`"
            raise DataError(paths.dataset(name), "has no recipe", fix)
        for session in session_names(recipe):
            targets.append(str(paths.acquired(name, session).relative_to(paths.root)))
    raise typer.Exit(run_snakemake(paths, names, [*targets, *options]))


def run_snakemake(paths: Paths, names: Sequence[str], options: Sequence[str]) -> int:
    """Print and run the command of Snakemake for data sets, and return its exit code."""
    command = snakemake_command(paths, names, options)
    check_console()
    print(shell_command(command), flush=True)
    process = subprocess.run(
        [sys.executable, "-m", *command], check=False, cwd=paths.root, env=utf8_environment()
    )
    return process.returncode


def utf8_environment() -> dict[str, str]:
    """Return variables with which Snakemake and its jobs print and write UTF-8, also on Windows."""
    return os.environ | {"PYTHONUTF8": "1"}


def check_console() -> None:
    """Raise DataError if Snakemake or the logger plugin of the profiles is not installed."""
    require_extra("workflow", "the workflow")
    # Snakemake finds plugins by these names, and not the modules of an editable installation.
    if "snakemake_logger_plugin_job_lines" not in {module.name for module in iter_modules()}:
        fix = 'run `pip install "ajgdata[workflow]"`, or `make env` in a clone'
        raise DataError("Snakemake", "its logger plugin job-lines is not installed", fix)


def split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names of data sets, which are first, and the options for Snakemake.

    >>> split_arguments(["size", "ycb", "--cores", "2"])
    (['size', 'ycb'], ['--cores', '2'])
    """
    names = list(takewhile(lambda text: not text.startswith("-"), arguments))
    return names, list(arguments[len(names) :])


def with_datasets(names: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return `options` with the configuration of Snakemake for a run of the data sets `names`.

    Without names, `options` are returned unchanged. Raises DataError for a second `--config`,
    because Snakemake uses only the last one.
    """
    if not names:
        return list(options)
    if any(text.split("=")[0] in CONFIG_OPTIONS for text in options):
        problem = "is already used to choose the data sets"
        raise DataError("--config", problem, "call snakemake with your own --config")
    datasets = f"datasets=[{','.join(names)}]"
    return [*options, "--config", datasets, "alone=True", "pages=[]", "publish=[]"]


def snakemake_command(paths: Paths, names: Sequence[str], options: Sequence[str]) -> list[str]:
    """Return the `snakemake` command for data sets, for the folder of the project.

    A project without Snakefile or profile uses those of the package.
    """
    command = ["snakemake"]
    if not paths.snakefile.is_file():
        command += ["--snakefile", str(SNAKEFILE)]
    if not paths.profile.is_file():
        command += ["--workflow-profile", str(packaged("profiles") / "default")]
    return [*command, *with_datasets(names, options)]
