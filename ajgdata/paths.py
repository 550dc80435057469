"""The names of all files of a project.

A project is the folder that contains `datasets/`. People write `datasets/` and `reports/`,
acquisition and import write `data/`, and the workflow writes `results/`. `.ajgdata/` is a cache,
which may be deleted.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

RESULTS_FOLDER = "results"
#: Folders in `results/` with files that `command_for` has a command for.
RESULT_FOLDERS = (
    "embed",
    "features",
    "gripper",
    "models",
    "quarantine",
    "runs",
    "tasks",
)
#: Tables of all data sets of a run, in `results/`.
RUN_TABLES = ("metrics.csv", "predictions.csv")
DATASET_FILE = "dataset.yaml"
SOURCE_FILE = "source.yaml"
SESSION_FILE = "session.yaml"
RECORDINGS_FILE = "recordings.csv"
CHANGES_FILE = "changes.jsonl"
AUDIO_FOLDER = "audio"
IMPORTED_TABLES_FOLDER = "tables"  #: in a session: imported tables of features
MODELS_FOLDER = "models"  #: final models in a published data set
EXCITATION_FILE = "excitation.wav"
# Names in the folder of a report.
INDEX = "index.html"
FIGURES_FOLDER = "figures"
TABLES_FOLDER = "tables"  #: tables as CSV files
EXPERIMENT_PAGES_FOLDER = "experiments"
RUNS_FILE = "runs.json"  #: data sets and models of the report
FIGURE_FORMATS = ("svg", "pdf")
#: Folder of the package `ajgdata`.
PACKAGE = Path(__file__).resolve().parent
#: Largest number of characters of a run's name that lists all its data sets.
LONGEST_RUN_NAME = 100


def packaged(name: str) -> Path:
    """Return a folder that is at the top of a clone, and a part of an installed package.

    Such folders are `config`, `datasets`, `profiles`, `reports` and `workflow`; setup.py lists
    their files.

    >>> packaged("workflow").joinpath("Snakefile").is_file()
    True
    """
    folder = PACKAGE / name
    return folder if folder.is_dir() else PACKAGE.parent / name


#: The workflow that comes with the package; Snakefiles of projects use it as a module.
SNAKEFILE = packaged("workflow") / "Snakefile"


def run_name(datasets: Sequence[str]) -> str:
    """Return the name of a run of selected data sets; "" for none, which is a run of all data sets.

    The order of `datasets` does not matter. A name that would be too long gives the first data set,
    the number of other data sets, and a digest.

    >>> run_name(["size", "angle"])
    'angle+size'
    """
    names = sorted(datasets)
    name = "+".join(names)
    if len(name) <= LONGEST_RUN_NAME:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()
    return f"{names[0]}+{len(names) - 1}~{digest[:12]}"


def short_name(name: str, longest: int) -> str:
    """Return `name`, or its beginning and a digest if it has more than `longest` characters.

    >>> short_name("material", 10), short_name("material of a sphere", 16)
    ('material', 'materia~47bceb77')
    """
    if len(name) <= longest:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()[:8]
    return f"{name[: longest - 9]}~{digest}"


def command_for(result: Path) -> str:
    """Return the command that computes the file `result` of a project again.

    The command runs the job of this file, also if the file is up to date. A command with
    `--forcerun` also runs the jobs that use the file. Returns "" if no command computes the file.

    >>> command_for(Path("results/features/size.nc"))
    'ajgdata run size --forcerun features'
    """
    parts = result.absolute().parts
    known = (*RESULT_FOLDERS, *RUN_TABLES)
    starts = [
        position
        for position, folder in enumerate(parts[:-1])
        if folder == RESULTS_FOLDER and parts[position + 1] in known
    ]
    if not starts:
        return ""  # for example a copy of a result outside a project
    start = starts[0]
    file = "/".join(parts[start:])
    name = result.name.partition(".")[0]
    match parts[start + 1 : -1]:
        case ("features" | "quarantine",):
            command = f"ajgdata run {name} --forcerun features"
        case ("embed", dataset, *_):
            command = f"ajgdata run {dataset} --forcerun embed"
        case ("models", dataset, task, model, *_):
            command = f"ajgdata train {dataset} {task} --model {model} --force"
        case ("tasks", dataset, *_):
            command = f"ajgdata run {dataset} --forcerun {file}"
        case ("gripper",):
            command = f"snakemake --force {file}"
        case ("runs", run, *_) if "~" not in run:
            command = f"ajgdata run {run.replace('+', ' ')} --forcerun collect"
        case ():
            command = "snakemake --forcerun collect"
        case _:
            command = ""
    return command


class FixedPath:
    """An attribute of `Paths` whose value is the path of one file or folder.

    `pattern` is the path below the folder `below`, which is another attribute of `Paths`.
    """

    def __init__(self, pattern: str, below: str = "root") -> None:
        self.pattern = pattern
        self.below = below

    def __get__(self, paths: Paths, owner: type[Paths] | None = None) -> Path:
        return getattr(paths, self.below) / self.pattern


class PathTemplate(FixedPath):
    """An attribute of `Paths` whose value is a function that returns the path of one of many files.

    The arguments of the function are the texts for the braces in `pattern`, in their order:
    `paths.session("size", "s01")` is the path of the session `s01` of the data set `size`.
    """

    def __get__(  # type: ignore[override]  # the value is a function, not a path
        self, paths: Paths, owner: type[Paths] | None = None
    ) -> Callable[..., Path]:
        folder = getattr(paths, self.below)
        names = re.findall(r"{(\w+)}", self.pattern)

        def path(*texts: str) -> Path:
            return folder / self.pattern.format_map(dict(zip(names, texts, strict=True)))

        return path


@dataclass(frozen=True)
class Paths:
    """The paths of all files of the project in the folder `root`.

    `run` is the name of a run of selected data sets (`run_name`), "" for a run of all data sets.
    Each run has a folder for the results that combine its data sets. A text such as
    `{dataset}` can be an argument, so these paths can be patterns of Snakemake.

    >>> Paths(Path("project")).features("size").as_posix()
    'project/results/features/size.nc'
    >>> Paths(run="size").metrics_table.as_posix()
    'results/runs/size/metrics.csv'
    """

    root: Path = Path()
    run: str = ""

    # Written by people.
    datasets = FixedPath("datasets")
    dataset = PathTemplate("datasets/{dataset}/" + DATASET_FILE)
    source = PathTemplate("datasets/{dataset}/" + SOURCE_FILE)
    dataset_schema = FixedPath("datasets/dataset.schema.json")  #: written by `pipeline.schemas`
    source_schema = FixedPath("datasets/source.schema.json")
    reports = FixedPath("reports")  #: texts and templates of the report, see `store.report_files`
    variants = FixedPath("reports/variants")  #: files of variants, see `types.variants`
    snakefile = FixedPath("Snakefile")  #: uses the workflow of the package as a module
    workflow_settings = FixedPath("config/config.yaml")  #: settings of the workflow
    profile = FixedPath("profiles/default/config.yaml")  #: options of Snakemake
    slurm_profile = FixedPath("profiles/slurm/config.yaml")
    project_readme = FixedPath("README.md")
    gitignore = FixedPath(".gitignore")
    example_dataset = FixedPath("datasets/example.yaml")  #: an explained dataset.yaml

    # Written by acquisition and import.
    data = FixedPath("data")
    recordings = PathTemplate("data/{dataset}")
    #: Checksums of a published data set that was downloaded.
    fetched_sums = PathTemplate("data/{dataset}/published/SHA256SUMS")
    sessions = PathTemplate("data/{dataset}/sessions")
    session = PathTemplate("data/{dataset}/sessions/{session}")
    #: Description of a session. It is written last, so a folder with this file is complete.
    session_file = PathTemplate("data/{dataset}/sessions/{session}/" + SESSION_FILE)
    recordings_file = PathTemplate("data/{dataset}/sessions/{session}/" + RECORDINGS_FILE)
    #: Decisions of people about the recordings of a session, see `store.changes`.
    changes_file = PathTemplate("data/{dataset}/sessions/{session}/" + CHANGES_FILE)
    events = PathTemplate("data/{dataset}/live/{session}/events.jsonl")  #: log of a live run

    # Written by the workflow for each data set.
    results = FixedPath(RESULTS_FOLDER)
    benchmarks = FixedPath("results/benchmarks")
    acquired = PathTemplate("results/acquired/{dataset}/{session}.done")
    features = PathTemplate("results/features/{dataset}.nc")  #: features and labels of all sessions
    #: Hashes of the features and of their inputs. `store.freshness` compares them to decide whether
    #: the features are up to date, so audio files of unchanged sessions are not read again.
    session_hashes = PathTemplate("results/features/{dataset}.hashes.json")
    quarantine = PathTemplate("results/quarantine/{dataset}.csv")
    #: Tables of one experiment; `models` is the name of its job: a model, a file of variants,
    #: `plain` or `all`. Equal inputs give equal bytes, except for the cost.
    experiment = PathTemplate("results/tasks/{dataset}/{task}/{experiment}.{models}.json")
    experiment_cost = PathTemplate("results/tasks/{dataset}/{task}/{experiment}.{models}.cost.json")
    training_cost = PathTemplate("results/embed/{dataset}/{embedding}/cost.json")
    latents = PathTemplate("results/embed/{dataset}/{embedding}/latents.nc")
    model = PathTemplate("results/models/{dataset}/{task}/{model}")
    exported = FixedPath("results/exported")  #: models as files for other computers
    sample = PathTemplate("results/samples/{dataset}.nc")  #: part of the features, for the package
    published = PathTemplate("results/published/{dataset}")  #: see `Tree`
    #: Checksums of a published data set. They are written last, when all other files are complete.
    published_sums = PathTemplate("results/published/{dataset}/SHA256SUMS")

    # Written by the workflow about the simulation.
    study = PathTemplate("results/gripper/{name}.json")

    # Written by the workflow for all data sets of a run together.
    metrics_table = FixedPath("metrics.csv", "run_results")
    predictions = FixedPath("predictions.csv", "run_results")
    metrics_of_everything = FixedPath("report/metrics.done", "run_results")
    complete = FixedPath("complete.txt", "run_results")  #: summary of `snakemake`
    everything = FixedPath("everything.txt", "run_results")  #: summary of `snakemake everything`
    report_on_everything = FixedPath("report/everything.done", "run_results")
    log = PathTemplate("logs/{rule}.log", "run_results")
    benchmark = PathTemplate("benchmarks/{rule}.tsv", "run_results")
    report = FixedPath("report/" + INDEX, "run_results")
    runs = FixedPath("report/" + RUNS_FILE, "run_results")  #: data sets and models of the report
    page = PathTemplate("report/{name}.html", "run_results")
    page_figures = PathTemplate("report/{page}", "run_results")
    opening = FixedPath(
        "report/opening/opening.json", "run_results"
    )  #: content of the opening picture

    # May be deleted at any time.
    cache = FixedPath(".ajgdata")
    responses = FixedPath(
        ".ajgdata/responses"
    )  #: impulse responses of the virtual gripper, by scene
    fetched = FixedPath(".ajgdata/fetched")  #: downloads of published data sets, by hash

    @property
    def run_results(self) -> Path:
        """The folder of the results of all data sets of the run together."""
        if not self.run:
            return self.results
        return self.results / "runs" / self.run


@dataclass(frozen=True)
class Tree:
    """The names of all files of a published data set in the folder `root`.

    The constants and the static methods are names relative to `root`, with `/` on every system.
    """

    root: Path

    README = "README.md"
    LICENCE = "LICENSE"
    CITATION = "CITATION.cff"
    SUMS = "SHA256SUMS"
    CROISSANT = "croissant.json"
    DATAPACKAGE = "datapackage.json"
    METADATA = "metadata.csv"
    TYPED_METADATA = "metadata.parquet"
    FEATURES = "features.nc"
    ARCHIVE = "audio.zip"
    #: Archive of `sessions`, `figures` and `models` in a deposit, which has no folders.
    FOLDERS = "folders.zip"
    DECLARATION = DATASET_FILE
    SPECTRA = "figures/spectra.png"

    @staticmethod
    def audio(session: str, name: str) -> str:
        """Return the name of a recording."""
        return f"{AUDIO_FOLDER}/{session}/{name}"

    @staticmethod
    def session(session: str) -> str:
        """Return the name of the description of a session."""
        return f"sessions/{session}/{SESSION_FILE}"

    @staticmethod
    def changes(session: str) -> str:
        """Return the name of the changes of the labels of a session."""
        return f"sessions/{session}/{CHANGES_FILE}"

    @staticmethod
    def model(task: str, model: str, file: str) -> str:
        """Return the name of a file of a final model."""
        return f"{MODELS_FOLDER}/{task}/{model}/{file}"

    @staticmethod
    def excitation(session: str, suffix: str) -> str:
        """Return the name of the file with the played sound of a session."""
        return f"sessions/{session}/excitation{suffix}"

    def __truediv__(self, name: str) -> Path:
        """Return the path of the file `name`."""
        return self.root / name


def find_project(start: str | Path | None = None) -> Paths:
    """Return the paths of the project that contains the folder `start`.

    Default: the environment variable AJGDATA_ROOT, else the working directory. Raises
    FileNotFoundError if neither the folder nor a folder above it contains `datasets/`.
    """
    if start is None:
        start = os.environ.get("AJGDATA_ROOT")
    first = Path(start or Path.cwd()).absolute()
    for folder in (first, *first.parents):
        if (folder / "datasets").is_dir():
            return Paths(folder)
    raise FileNotFoundError(
        f"no project at {first} or above it. Create one with `ajgdata new FOLDER`, or go to the "
        "folder that contains datasets/."
    )


def public_recordings(name: str) -> Path:
    """Return the folder of the downloaded recordings of a public data set.

    The folder is outside of all projects, because several projects may use the recordings. The
    environment variable AJGDATA_CACHE names another parent folder than the cache of the system.
    """
    import pooch  # only downloads need this package, which takes 0.1 s to import

    return Path(os.environ.get("AJGDATA_CACHE") or pooch.os_cache("ajgdata")) / "sources" / name
