"""Every file name of a project, spelled once.

A project is the folder that holds `datasets/`. `datasets/` and `reports/` are written by people,
`data/` by acquisition and import, `results/` by the workflow; `.ajgdata/` is a cache that may be
deleted.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

DATASET_FILE = "dataset.yaml"
SOURCE_FILE = "source.yaml"
SESSION_FILE = "session.yaml"
RECORDINGS_FILE = "recordings.csv"
AUDIO_FOLDER = "audio"
#: What the last import found in the folder, beside what people made of it since.
EXCITATION_FILE = "excitation.wav"
#: Beside each report: its figures, and what it is about.
FIGURES, RUNS_FILE = "figures", "runs.json"
#: Beside it too: recordings to be heard.
SOUNDS = "sounds"
#: And its tables as CSV.
TABLES = "tables"
INDEX = "index.html"
#: Beside each report: its pages on single experiments.
EXPERIMENT_PAGES = "experiments"
#: Page on why simulation and paper differ.
ABLATIONS_PAGE = "ablations"
FIGURE_FORMATS = ("svg", "png", "pdf")
#: Tells the checks of the results which run they are of; see `Paths.run`.
RUN_VARIABLE = "AJGDATA_RUN"
#: Of more data sets than this many letters name, a run's name holds a digest.
LONGEST_RUN = 100


def run_name(datasets: Sequence[str]) -> str:
    """Return the name of a run of these data sets alone, whatever their order; "" of none."""
    names = sorted(datasets)
    name = "+".join(names)
    if len(name) <= LONGEST_RUN:
        return name
    digest = hashlib.sha256(name.encode()).hexdigest()
    return f"{names[0]}+{len(names) - 1}~{digest[:12]}"


@dataclass(frozen=True)
class Paths:
    """Places of files, relative to a project folder. Patterns keep `{wildcards}` untouched.

    `run` names a run of some data sets alone: what is told of all its data sets together stands
    apart from that of a whole run.
    """

    root: Path = Path()
    run: str = ""

    @property
    def datasets(self) -> Path:
        """Declarations of the data sets."""
        return self.root / "datasets"

    @property
    def results(self) -> Path:
        """Everything that the workflow makes."""
        return self.root / "results"

    @property
    def of_run(self) -> Path:
        """Return the folder of what a run says of all its data sets together."""
        return self.results / "runs" / self.run if self.run else self.results

    @property
    def comparisons(self) -> Path:
        """Folder of the comparisons, which people write."""
        return self.reports / "comparisons"

    @property
    def ablation_settings(self) -> Path:
        """Folder of the ablations, which people write."""
        return self.reports / "ablations"

    @property
    def reports(self) -> Path:
        """Return the folder of what people edit to change a report; see `store.report_files`."""
        return self.root / "reports"

    @property
    def data(self) -> Path:
        """Raw sessions of all data sets."""
        return self.root / "data"

    @property
    def cache(self) -> Path:
        """Return the folder that may be deleted at any time."""
        return self.root / ".ajgdata"

    @property
    def benchmarks(self) -> Path:
        """Return the folder of what Snakemake measured of each job."""
        return self.results / "benchmarks"

    @property
    def logs(self) -> Path:
        """What jobs said, by rule."""
        return self.results / "logs"

    def dataset(self, dataset: str) -> Path:
        """Declaration of one data set."""
        return self.datasets / dataset / DATASET_FILE

    def source(self, dataset: str) -> Path:
        """Return the file that says where a public data set is brought from."""
        return self.datasets / dataset / SOURCE_FILE

    def sessions(self, dataset: str) -> Path:
        """Raw sessions of one data set."""
        return self.data / dataset / "sessions"

    def recordings(self, dataset: str) -> Path:
        """Return the folder of all that was recorded of one data set."""
        return self.data / dataset

    def session(self, dataset: str, session: str) -> Path:
        """One raw session."""
        return self.sessions(dataset) / session

    def session_file(self, dataset: str, session: str) -> Path:
        """Return what describes a session: written last, so that it is whole."""
        return self.session(dataset, session) / SESSION_FILE

    def recordings_file(self, dataset: str, session: str) -> Path:
        """Return the table of the recordings of a session."""
        return self.session(dataset, session) / RECORDINGS_FILE

    def acquired(self, dataset: str, session: str) -> Path:
        """Return the file that says that a run recorded a session of a recipe."""
        return self.results / "acquired" / dataset / f"{session}.done"

    def events(self, dataset: str, session: str) -> Path:
        """Return the log of the live run that recorded a session."""
        return self.data / dataset / "live" / session / "events.jsonl"

    def shard(self, dataset: str, session: str) -> Path:
        """Features of one session."""
        return self.results / "features" / dataset / f"{session}.nc"

    def shard_findings(self, dataset: str, session: str) -> Path:
        """Return the file of what was found wrong or odd while making a shard."""
        return self.results / "features" / dataset / f"{session}.findings.csv"

    def shard_labels(self, dataset: str, session: str) -> Path:
        """Labels of a session: joined to its features on merging."""
        return self.results / "features" / dataset / f"{session}.labels.csv"

    def features(self, dataset: str) -> Path:
        """Features and labels of a data set: labelled spectra of all sessions."""
        return self.results / "features" / f"{dataset}.nc"

    def quarantine(self, dataset: str) -> Path:
        """Recordings that were left out or flagged, with the reason and the fix."""
        return self.results / "quarantine" / f"{dataset}.csv"

    def experiment(self, dataset: str, task: str, kind: str) -> Path:
        """Return the tables of one experiment: the same bytes for the same inputs.

        `kind` is the experiment's name, and that of the model if each is measured by itself:
        `learning_curve-cnn`.
        """
        return self.results / "tasks" / dataset / task / f"{kind}.json"

    def experiment_cost(self, dataset: str, task: str, kind: str) -> Path:
        """Return what it cost, times and memory: measured, hence never the same twice."""
        return self.results / "tasks" / dataset / task / f"{kind}.cost.json"

    def embedding(self, dataset: str, embedding: str) -> Path:
        """Folder of what is known of one embedding."""
        return self.results / "embed" / dataset / embedding

    def training_cost(self, dataset: str, embedding: str) -> Path:
        """Return the file of what training an embedding's encoders took."""
        return self.embedding(dataset, embedding) / "cost.json"

    def latents(self, dataset: str, embedding: str) -> Path:
        """Every recording as every network of an embedding sees it."""
        return self.embedding(dataset, embedding) / "latents.nc"

    def models(self, dataset: str) -> Path:
        """Folder of all models of a data set."""
        return self.results / "models" / dataset

    def model(self, dataset: str, task: str, model: str) -> Path:
        """Folder of a model trained on all recordings of a task."""
        return self.models(dataset) / task / model

    @property
    def exported(self) -> Path:
        """Folder of models as files for other computers, unless another one is named."""
        return self.results / "exported"

    def results_of(self, dataset: str) -> tuple[Path, ...]:
        """Files and folders of `results` that hold nothing but one data set."""
        kinds = ("acquired", "features", "tasks", "models", "published")
        folders = (self.results / kind / dataset for kind in kinds)
        return (self.features(dataset), self.quarantine(dataset), *folders)

    @property
    def snakefile(self) -> Path:
        """The workflow, if the project has its own."""
        return self.root / "Snakefile"

    def figure(self, name: str) -> Path:
        """A figure without its suffix; see FIGURE_FORMATS."""
        return self.report.parent / FIGURES / name

    @property
    def all_metrics(self) -> Path:
        """Every result with fold values, seeds and provenance."""
        return self.of_run / "metrics.json"

    @property
    def metrics_table(self) -> Path:
        """Return the file of the same numbers, one a row."""
        return self.of_run / "metrics.csv"

    @property
    def predictions(self) -> Path:
        """Return every held-out prediction of cross-validation, one a row."""
        return self.of_run / "predictions.csv"

    @property
    def runs(self) -> Path:
        """Return the file that lists the data sets and evaluated models of the report."""
        return self.report.with_name(RUNS_FILE)

    @property
    def complete(self) -> Path:
        """Return the summary of a run that made all that it was asked for."""
        return self.of_run / "complete.txt"

    @property
    def verified(self) -> Path:
        """Return what the checks of a run's results ended with."""
        return self.of_run / "verify" / "summary.txt"

    @property
    def verified_solver(self) -> Path:
        """Return what the long checks of the solver ended with: of no run's results."""
        return self.results / "verify" / "solver.txt"

    def log(self, rule: str) -> Path:
        """Return the log of a rule that has one job a run."""
        return self.of_run / "logs" / f"{rule}.log"

    def benchmark(self, rule: str) -> Path:
        """Return what Snakemake measured of it."""
        return self.of_run / "benchmarks" / f"{rule}.tsv"

    @property
    def report(self) -> Path:
        """The report."""
        return self.of_run / "report" / INDEX

    def report_on(self, experiment: str) -> Path:
        """A report on one experiment alone."""
        return self.results / f"report_{experiment}" / INDEX

    def study(self, name: str) -> Path:
        """Figures of one study of the virtual gripper."""
        return self.results / "gripper" / f"{name}.json"

    def ablation(self, name: str) -> Path:
        """Tables of one ablation: why simulation and paper differ."""
        return self.results / "ablations" / f"{name}.json"

    def published(self, dataset: str) -> Path:
        """A data set as others get it; see `Tree`."""
        return self.results / "published" / dataset

    def published_sums(self, dataset: str) -> Path:
        """Return the list of checksums of a published data set: written when the rest is whole."""
        return self.published(dataset) / Tree.SUMS

    def page(self, name: str) -> Path:
        """Another page of the report, beside it."""
        return self.report.with_name(f"{name}.html")

    def explorer(self, dataset: str, embedding: str) -> Path:
        """Page on which every recording of an embedding is seen and heard."""
        return self.report.parent / "latents" / dataset / f"{embedding}.html"

    @property
    def opening(self) -> Path:
        """Return the file of what the opening picture shows; see `pipeline.opening`."""
        return self.report.parent / "opening" / "opening.json"

    def opening_picture(self, *, narrow: bool = False) -> Path:
        """Return the opening picture, wide or as narrow as a phone, without its suffix."""
        return self.opening.with_name("opening-narrow" if narrow else "opening")

    def page_figures(self, page: str) -> Path:
        """Folder of the figures of such a page."""
        return self.report.parent / page

    @property
    def responses(self) -> Path:
        """Impulse responses of the virtual gripper, by scene: shared by all data sets."""
        return self.cache / "responses"

    @property
    def fetched(self) -> Path:
        """Files of published data sets, kept by hash until the data set is registered."""
        return self.cache / "fetched"


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
    CITATION = "CITATION.cff"
    SUMS = "SHA256SUMS"
    CROISSANT = "croissant.json"
    DATAPACKAGE = "datapackage.json"
    METADATA = "metadata.csv"
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
        f"no project at {here} or above it: go to the folder that holds datasets/, "
        "or set AJGDATA_ROOT to it"
    )
