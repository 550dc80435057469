# From recordings to the report: `snakemake` runs everything that is out of date.
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger
from snakemake.utils import min_version, validate

from ajgdata.ablations import possible
from ajgdata.acquire.recipe import recipe_hash
from ajgdata.experiments import measure_files
from ajgdata.paths import (
    ABLATIONS_PAGE,
    EXPERIMENT_PAGES,
    FIGURES,
    TABLES,
    Paths,
    run_name,
)
from ajgdata.pipeline.console import show_jobs
from ajgdata.pipeline.experiments import asked_for, models_of
from ajgdata.pipeline.opening import KIND as OPENING_KIND
from ajgdata.pipeline.opening import OBJECT, subject_of
from ajgdata.pipeline.plan import (
    Declared,
    errors_in_one_line,
    plan,
    published,
    session_files,
)
from ajgdata.pipeline.run_summary import end_run, modified_ns
from ajgdata.pipeline.site import navigation_of
from ajgdata.pipeline.studies import STUDIES, ablation_hash, study_hash
from ajgdata.report.navigation import FIXED
from ajgdata.store.files import read_yaml
from ajgdata.store.provenance import layer_hash, settings_digest
from ajgdata.store.report_files import report_files_digest

min_version("9.10")

# Also correct if another Snakefile includes this one.
HERE = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
# Snakemake ignores `configfile` if a module is given a `config`.
config = read_yaml(HERE / "workflow/config/default.yaml") | config

try:
    validate(config, str(HERE / "workflow/schemas/config.schema.yaml"))
except WorkflowError as error:  # one line instead of the whole schema
    wrong = error.__context__
    raise SystemExit(
        f"config{wrong.json_path[1:]}: {wrong.message}; correct it"
    ) from None

PATHS = Paths(run=run_name(config["datasets"] or ()) if config["alone"] else "")
REPORT_FILES = report_files_digest(PATHS)

with errors_in_one_line():
    # Jobs use what the main process has checked.
    PLANS = Declared(plan(PATHS, config["datasets"], check=workflow.is_main_process))
    SPECS = Declared({name: one.spec for name, one in PLANS.items()})
    SESSION_FILES = session_files(PATHS, PLANS)
    PUBLISHED = published(PLANS, config["publish"])
    # Tasks and embeddings, as data set and name.
    MEASURED = [(name, task) for name, spec in SPECS.items() for task in spec.tasks]
    MEASURED += [(name, one) for name, spec in SPECS.items() for one in spec.embeddings]
    ASKED = Declared(
        {
            (one.dataset, one.task, kind): one
            for one in asked_for(SPECS, MEASURED)
            for kind in one.kinds
        }
    )
    SIMULATED = [name for name, one in PLANS.items() if one.virtual]
    ABLATED = {} if config["quick"] else possible(PATHS, SIMULATED)
    # Pages on the simulation, if they are possible and configured.
    PAGES = [ABLATIONS_PAGE] * bool(ABLATED) + [*STUDIES]
    if config["pages"] is not None:
        PAGES = [name for name in PAGES if name in config["pages"]]
    NAVIGATION = navigation_of(PATHS, SPECS, MEASURED, PAGES)
    # Data set of the opening picture.
    OPENING = subject_of(SPECS) if PAGES else ""

EVERYTHING = [
    PATHS.report,
    PATHS.all_metrics,
    *dict.fromkeys(PATHS.models(one[0]) for one in models_of(SPECS, MEASURED)),
    *(PATHS.published_sums(name) for name in PUBLISHED),
]


wildcard_constraints:
    dataset="[A-Za-z0-9_-]+",
    session="[A-Za-z0-9_-]+",
    task="[A-Za-z0-9_-]+",
    embedding="[A-Za-z0-9_-]+",
    kind="[a-z0-9_]+(-[A-Za-z0-9_]+)?",


rule all:
    default_target: True
    input:
        EVERYTHING,
        PATHS.complete,


SUMMARY_BEFORE = modified_ns(PATHS.complete)


# Not called in a dry run or in the processes of jobs.
onstart:
    show_jobs(logger)


onsuccess:
    end_run(PATHS.complete, SUMMARY_BEFORE)


include: "workflow/rules/common.smk"
include: "workflow/rules/acquire.smk"
include: "workflow/rules/features.smk"
include: "workflow/rules/experiments.smk"
include: "workflow/rules/embed.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/pages.smk"
include: "workflow/rules/publish.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/complete.smk"
