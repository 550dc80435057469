"""Every file name of a project, spelled once.

A project is the folder that holds `datasets/`. `datasets/` and `reports/` are written by people,
`data/` by acquisition and import, `results/` by the workflow; `.ajgdata/` is a cache that may be
deleted.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

RESULTS_FOLDER = "results"
#: Folders in it with results that a command computes again.
RESULT_FOLDERS = (
    "ablations",
    "embed",
    "features",
    "gripper",
    "models",
    "quarantine",
    "runs",
    "tasks",
)
#: Tables of a whole run in it.
RUN_TABLES = ("metrics.csv", "predictions.csv")
DATASET_FILE = "dataset.yaml"
SOURCE_FILE = "source.yaml"
SESSION_FILE = "session.yaml"
RECORDINGS_FILE = "recordings.csv"
AUDIO_FOLDER = "audio"
EXCITATION_FILE = "excitation.wav"
#: In the folder of each report: figures, tables as CSV, pages on experiments, and its content.
FIGURES_FOLDER, TABLES_FOLDER, EXPERIMENT_PAGES_FOLDER, RUNS_FILE = (
    "figures",
    "tables",
    "experiments",
    "runs.json",
)
INDEX = "index.html"
FIGURE_FORMATS = ("svg", "pdf")
#: Of more data sets than this many letters name, a run's name holds a digest.
LONGEST_RUN_NAME = 100


def run_name(datasets: Sequence[str]) -> str:
    """Return the name of a run of only `datasets`, in any order; "" if there are none."""
    names = sorted(datasets)
    name = "+".join(names)
    if len(name) <= LONGEST_RUN_NAME:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()
    return f"{names[0]}+{len(names) - 1}~{digest[:12]}"


def short_name(name: str, longest: int) -> str:
    """Return a name of a file: `name`, or its beginning and a digest if it is longer.

    >>> short_name("material", 10), short_name("material of a sphere", 16)
    ('material', 'materia~47bceb77')
    """
    if len(name) <= longest:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()[:8]
    return f"{name[: longest - 9]}~{digest}"


def command_for(result: Path) -> str:
    """Return the command that computes a result of a project again, "" if there is no command.

    `result` is its path. The command runs the job of this result, also if the job is up to date. A
    command with `--forcerun` also runs the jobs that follow from it.

    >>> command_for(Path("results/features/size.nc"))
    'ajgdata run size --forcerun features'
    """
    parts = result.absolute().parts
    starts = (
        place
        for place, folder in enumerate(parts[:-1])
        if folder == RESULTS_FOLDER and parts[place + 1] in (*RESULT_FOLDERS, *RUN_TABLES)
    )
    start = next(starts, None)
    if start is None:
        return ""  # for example a copy of a result
    file = "/".join(parts[start:])
    name = result.name.partition(".")[0]
    match parts[start + 1 : -1]:
        case ("features" | "quarantine",):
            command = f"ajgdata run {name} --forcerun features"
        case ("embed", dataset, *_):
            command = f"ajgdata run {dataset} --forcerun embed"
        case ("models", dataset, *_):
            command = f"ajgdata run {dataset} --forcerun train"
        case ("tasks", dataset, *_):
            command = f"ajgdata run {dataset} --forcerun {file}"
        case ("gripper" | "ablations",):
            command = f"snakemake --force {file}"
        case ("runs", run, *_) if "~" not in run:
            command = f"ajgdata run {run.replace('+', ' ')} --forcerun collect"
        case ():
            command = "snakemake --forcerun collect"
        case _:
            command = ""
    return command


class Place:
    """A file or folder of a project: its pattern below a folder of `Paths`."""

    def __init__(self, pattern: str, below: str = "root") -> None:
        self.pattern, self.below = pattern, below

    def __get__(self, paths: Paths, owner: type[Paths] | None = None) -> Path:
        return getattr(paths, self.below) / self.pattern


class Places(Place):
    """Files of which there are several: called with what stands in the braces of the pattern."""

    def __get__(  # type: ignore[override]  # several files: a function, not one path
        self, paths: Paths, owner: type[Paths] | None = None
    ) -> Callable[..., Path]:
        folder, names = getattr(paths, self.below), re.findall(r"{(\w+)}", self.pattern)

        def place(*texts: str) -> Path:
            return folder / self.pattern.format_map(dict(zip(names, texts, strict=True)))

        return place


@dataclass(frozen=True)
class Paths:
    """Places of files, relative to a project folder. Patterns keep `{wildcards}` untouched.

    `run` names a run of selected data sets: results of all its data sets together are
    apart from that of a whole run.
    """

    root: Path = Path()
    run: str = ""

    # Written by people.
    datasets = Place("datasets")
    dataset = Places("datasets/{dataset}/" + DATASET_FILE)
    source = Places("datasets/{dataset}/" + SOURCE_FILE)
    dataset_schema = Place("datasets/dataset.schema.json")  #: written by `pipeline.schemas`
    source_schema = Place("datasets/source.schema.json")
    reports = Place("reports")  #: what people edit to change a report; see `store.report_files`
    comparisons = Place("reports/comparisons")
    ablation_settings = Place("reports/ablations")
    snakefile = Place("Snakefile")  #: the workflow, if the project has its own

    # Written by acquisition and import.
    data = Place("data")
    recordings = Places("data/{dataset}")
    #: Checksums of a published data set that was fetched.
    fetched_sums = Places("data/{dataset}/published/SHA256SUMS")
    sessions = Places("data/{dataset}/sessions")
    session = Places("data/{dataset}/sessions/{session}")
    #: Describes a session: written last, so that it is whole.
    session_file = Places("data/{dataset}/sessions/{session}/" + SESSION_FILE)
    recordings_file = Places("data/{dataset}/sessions/{session}/" + RECORDINGS_FILE)
    events = Places("data/{dataset}/live/{session}/events.jsonl")  #: log of a live run

    # Written by the workflow, per data set.
    results = Place(RESULTS_FOLDER)
    benchmarks = Place("results/benchmarks")
    acquired = Places("results/acquired/{dataset}/{session}.done")
    features = Places("results/features/{dataset}.nc")  #: features and labels of all sessions
    #: Hashes of the features and of all that they were computed from, see `store.freshness`: they
    #: decide what is up to date. Audio files of unchanged sessions are not read again.
    session_hashes = Places("results/features/{dataset}.hashes.json")
    quarantine = Places("results/quarantine/{dataset}.csv")
    #: Tables of one experiment; `models` is the name of its job: a model, `plain` or `all`.
    #: Equal inputs give equal bytes, except for the cost.
    experiment = Places("results/tasks/{dataset}/{task}/{experiment}.{models}.json")
    experiment_cost = Places("results/tasks/{dataset}/{task}/{experiment}.{models}.cost.json")
    training_cost = Places("results/embed/{dataset}/{embedding}/cost.json")
    latents = Places("results/embed/{dataset}/{embedding}/latents.nc")
    models = Places("results/models/{dataset}")
    model = Places("results/models/{dataset}/{task}/{model}")
    exported = Place("results/exported")  #: models as files for other computers
    sample = Places("results/samples/{dataset}.nc")  #: part of the features, for the package
    published = Places("results/published/{dataset}")  #: see `Tree`
    #: Checksums of a published data set: written when the rest is whole.
    published_sums = Places("results/published/{dataset}/SHA256SUMS")

    # Written by the workflow, of the simulation.
    study = Places("results/gripper/{name}.json")
    ablation = Places("results/ablations/{name}.json")

    # Written by the workflow, of all data sets of a run together.
    metrics_table = Place("metrics.csv", "of_run")
    predictions = Place("predictions.csv", "of_run")
    metrics_of_everything = Place("report/metrics.done", "of_run")
    complete = Place("complete.txt", "of_run")  #: summary of `snakemake`
    everything = Place("everything.txt", "of_run")  #: summary of `snakemake everything`
    report_on_everything = Place("report/everything.done", "of_run")
    log = Places("logs/{rule}.log", "of_run")
    benchmark = Places("benchmarks/{rule}.tsv", "of_run")
    report = Place("report/" + INDEX, "of_run")
    runs = Place("report/" + RUNS_FILE, "of_run")  #: data sets and models of the report
    page = Places("report/{name}.html", "of_run")
    page_figures = Places("report/{page}", "of_run")
    opening = Place("report/opening/opening.json", "of_run")  #: content of the opening picture

    # May be deleted at any time.
    cache = Place(".ajgdata")
    responses = Place(".ajgdata/responses")  #: of the virtual gripper, by scene
    fetched = Place(".ajgdata/fetched")  #: of published data sets, by hash

    @property
    def of_run(self) -> Path:
        """Return the folder of what a run says of all its data sets together."""
        return self.results / "runs" / self.run if self.run else self.results


def brought(name: str) -> Path:
    """Return the folder of the recordings of a public data set: outside of every project, since
    several may use them. AJGDATA_CACHE names another place than the system's for such files."""
    import pooch  # whoever asks fetches: nothing else needs it

    return Path(os.environ.get("AJGDATA_CACHE") or pooch.os_cache("ajgdata")) / "sources" / name


@dataclass(frozen=True)
class Tree:
    """A published data set: every file name inside it. Names relative to it use `/`."""

    root: Path

    README = "README.md"
    LICENCE = "LICENSE"
    SUMS = "SHA256SUMS"
    CROISSANT = "croissant.json"
    DATAPACKAGE = "datapackage.json"
    METADATA = "metadata.csv"
    TYPED_METADATA = "metadata.parquet"
    FEATURES = "features.nc"
    ARCHIVE = "audio.zip"
    DECLARATION = DATASET_FILE
    SPECTRA = "figures/spectra.png"

    @staticmethod
    def audio(session: str, name: str) -> str:
        """One recording."""
        return f"{AUDIO_FOLDER}/{session}/{name}"

    @staticmethod
    def session(session: str) -> str:
        """Return the file in which a session describes itself."""
        return f"sessions/{session}/{SESSION_FILE}"

    @staticmethod
    def excitation(session: str, suffix: str) -> str:
        """The sound that a session played."""
        return f"sessions/{session}/excitation{suffix}"

    def __truediv__(self, name: str) -> Path:
        """Return the path of the file `name`."""
        return self.root / name


def find_project(start: str | Path | None = None) -> Paths:
    """The project that holds `start` (default: AJGDATA_ROOT, else the working directory).

    Raises FileNotFoundError when neither it nor a parent has a `datasets` folder.
    """
    if start is None and (root := os.environ.get("AJGDATA_ROOT")):
        start = Path(root)
    here = Path(start or Path.cwd()).absolute()
    for folder in (here, *here.parents):
        if (folder / "datasets").is_dir():
            return Paths(folder)
    raise FileNotFoundError(
        f"no project at {here} or above it. Go to the folder that contains datasets/, "
        "or set AJGDATA_ROOT to it."
    )
