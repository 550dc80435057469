# Recordings in, report out: `snakemake` runs everything that is not current.
from functools import partial
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version, validate

from ajgdata.ablations import possible
from ajgdata.acquire.recipe import recipe_hash
from ajgdata.experiments import measure_files, packages_of
from ajgdata.experiments.embedding_projections import NAME as PROJECTIONS
from ajgdata.paths import (
    ABLATIONS_PAGE,
    EXPERIMENT_PAGES,
    FIGURES,
    RUNS_FILE,
    TABLES,
    Paths,
    run_name,
)
from ajgdata.pipeline.experiments import (
    asked_for,
    datasets_of,
    models_of,
    tasks_by_report,
)
from ajgdata.pipeline.opening import subject_of
from ajgdata.pipeline.plan import errors_stop_snakemake, plan, published, solved_by
from ajgdata.pipeline.run import end_run, modified_ns
from ajgdata.pipeline.site import navigation_of
from ajgdata.pipeline.studies import (
    STUDIES,
    ablation_hash,
    study_hash,
)
from ajgdata.report.navigation import FIXED, plain
from ajgdata.store.files import read_yaml
from ajgdata.store.provenance import layer_hash, settings_digest
from ajgdata.store.report_files import report_files_digest
from ajgdata.types import SOURCES

min_version("9.10")

# Also where another Snakefile includes this one.
HERE = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
# Not `configfile`, which Snakemake leaves out where a module is given a `config`.
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
# Jobs run what the main process has checked.
with errors_stop_snakemake("project"):
    PLANS = plan(PATHS, config["datasets"], check=workflow.is_main_process)
    PUBLISHED = published(PLANS, config["publish"])
SPECS = {name: one.spec for name, one in PLANS.items()}
TASKS = [(name, task) for name, spec in SPECS.items() for task in spec.tasks]
MEASURED = TASKS + [
    (name, one) for name, spec in SPECS.items() for one in spec.embeddings
]
REPORTS = tasks_by_report(SPECS)
ASKED = {
    (one.dataset, one.task, kind): one
    for one in asked_for(SPECS, MEASURED)
    for kind in one.kinds
}
with errors_stop_snakemake("project"):
    ABLATED = possible(PATHS, [name for name, one in PLANS.items() if one.virtual])
# Further pages: why simulation and paper differ, and on the virtual gripper.
PAGES = [
    name
    for name in (
        *([ABLATIONS_PAGE] if ABLATED else []),
        *STUDIES,
    )
    if config["pages"] is None or name in config["pages"]
]


LATENTS = list(dict.fromkeys(key[:2] for key in ASKED if ASKED[key].of_latents))
with errors_stop_snakemake("project"):
    NAVIGATION = plain(navigation_of(PATHS, SPECS, MEASURED, PAGES, LATENTS))


wildcard_constraints:
    dataset="[A-Za-z0-9_-]+",
    session="[A-Za-z0-9_-]+",
    task="[A-Za-z0-9_-]+",
    embedding="[A-Za-z0-9_-]+",
    kind="[a-z0-9_]+(-[A-Za-z0-9_]+)?",


# The solver is checked where it made recordings.
WITHOUT_SOLVER = config["quick"] or not any(one.virtual for one in PLANS.values())


include: "workflow/rules/common.smk"


EVERYTHING = [
    PATHS.report,
    PATHS.all_metrics,
    *dict.fromkeys(PATHS.models(one[0]) for one in models_of(SPECS, TASKS)),
    PATHS.verified,
    *([] if WITHOUT_SOLVER else [PATHS.verified_solver]),
    *(PATHS.published_sums(name) for name in PUBLISHED),
]


rule all:
    default_target: True
    input:
        EVERYTHING,
        PATHS.complete,


SUMMARY_BEFORE = modified_ns(PATHS.complete)


onsuccess:
    end_run(PATHS.complete, SUMMARY_BEFORE)


include: "workflow/rules/acquire.smk"
include: "workflow/rules/features.smk"
include: "workflow/rules/experiments.smk"
include: "workflow/rules/embed.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/pages.smk"
include: "workflow/rules/publish.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/verify.smk"
