# The workflow, from recordings to the report. `snakemake` computes the results of the paper, and the
# studies of error against run time, stability and omissions. `snakemake everything` computes all
# results.
import functools
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version, validate

from ajgdata.acquire.recipe import recipe_hash
from ajgdata.experiments.registry import measuring_half, own_experiment_files
from ajgdata.experiments.requests import of_paper, requests_for, without_late
from ajgdata.paths import (
    EXPERIMENT_PAGES_FOLDER,
    FIGURES_FOLDER,
    TABLES_FOLDER,
    Paths,
    run_name,
)
from ajgdata.pipeline.opening_subject import OBJECT, SHOWN_RESULT, subject_of
from ajgdata.pipeline.plan import (
    Declared,
    errors_in_one_line,
    plan,
    published,
    session_files,
)
from ajgdata.pipeline.processes import process_count
from ajgdata.pipeline.run_changes import (
    changed_during_run,
    correct_future_times,
    feature_states,
)
from ajgdata.pipeline.run_end import end_run, modified_ns
from ajgdata.pipeline.studies import REQUESTED_STUDIES, STUDIES
from ajgdata.report.navigation import FIXED
from ajgdata.store.code_hash import code_hash, package_hash
from ajgdata.store.files import read_yaml
from ajgdata.store.freshness import (
    count_changed,
    features_key,
    run_tables,
)
from ajgdata.store.provenance import settings_digest
from ajgdata.store.report_files import report_files_digest

min_version("9.22")

# Folder of this file, also if another Snakefile includes it.
HERE = Path(workflow.current_basedir.get_path_or_uri(secret_free=True))
# The defaults are read here, because Snakemake ignores `configfile` in a module with a `config`.
config = read_yaml(HERE / "workflow/config/default.yaml") | config

try:
    validate(config, str(HERE / "workflow/schemas/config.schema.yaml"))
except WorkflowError as error:
    # The message of `error` contains the whole schema, that of its cause is one line.
    cause = error.__context__
    raise SystemExit(
        f"config{cause.json_path[1:]}: {cause.message}. Correct it."
    ) from None

RUN = run_name(config["datasets"] or ()) if config["alone"] else ""
PATHS = Paths(run=RUN)
REPORT_FILES = report_files_digest(PATHS)

with errors_in_one_line():
    # Only the main process checks the data sets, because the processes of its jobs parse this file
    # again.
    PLANS = Declared(plan(PATHS, config["datasets"], check=workflow.is_main_process))
    SPECS = Declared({name: item.spec for name, item in PLANS.items()})
    SESSION_FILES = session_files(PATHS, PLANS)
    STATES = feature_states(PATHS, PLANS) if workflow.is_main_process else {}
    PUBLISHED = published(PLANS, config["publish"])
    # Tasks and embeddings as (data set, name).
    MEASURED = [(name, task) for name, spec in SPECS.items() for task in spec.tasks]
    MEASURED += [
        (name, embedding)
        for name, spec in SPECS.items()
        for embedding in spec.embeddings
    ]
    # The part of a requested experiment that a job measures, by (data set, task, experiment, job).
    REQUESTS = Declared(
        {
            job: item.of_job(job[-1])
            for item in requests_for(SPECS, MEASURED)
            for job in item.jobs
        }
    )
    PAGES = list(STUDIES) if config["pages"] is None else config["pages"]
    # Data set of the opening picture, "" if there is none.
    OPENING = subject_of(SPECS) if PAGES else ""

# The target `all` computes the results of the paper. If no task has a published value, it computes
# all results except those that explain differences.
PAPER = {} if config["alone"] else of_paper(SPECS, REQUESTS)
FIRST = PAPER or without_late(REQUESTS)
# Keys of measurements, each once.
FIRST_RESULTS = list(
    dict.fromkeys(key for request in FIRST.values() for key in request.keys)
)
RESULTS = list(
    dict.fromkeys(key for request in REQUESTS.values() for key in request.keys)
)
FIRST_DATASETS = list(PLANS)
if PAPER:
    used = [
        name for item in PAPER.values() for name in (item.dataset, *item.other_sets)
    ]
    FIRST_DATASETS = list(dict.fromkeys(used))
# Final models as (data set, task, model).
FINAL_MODELS = [
    (name, task, model)
    for name, spec in SPECS.items()
    for task, model in spec.trained_models()
]


wildcard_constraints:
    dataset="[A-Za-z0-9_-]+",
    session="[A-Za-z0-9_-]+",
    task="[A-Za-z0-9_-]+",
    embedding="[A-Za-z0-9_-]+",
    experiment="[A-Za-z0-9_-]+",
    models="[A-Za-z0-9_-]+",
    model="[A-Za-z0-9_-]+",


# Times of the summaries before the run.
SUMMARIES = {path: modified_ns(path) for path in (PATHS.complete, PATHS.everything)}


# Neither a dry run nor the process of a job executes this.
onstart:
    correct_future_times(
        PATHS, [file for files in SESSION_FILES.values() for file in files]
    )


onsuccess:
    end_run(SUMMARIES, changed_during_run(PATHS, PLANS, STATES))


include: "workflow/rules/common.smk"
include: "workflow/rules/acquire.smk"
include: "workflow/rules/features.smk"
include: "workflow/rules/experiments.smk"
include: "workflow/rules/embed.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/publish.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/complete.smk"


# Each result is listed, because Snakemake does not compute a deleted input of an up-to-date job.
rule all:
    default_target: True
    input:
        PATHS.complete,
        rules.complete.input,
        rules.collect.output,
        rules.report.input,
        rules.report.output,
        embedding_files(FIRST),


rule everything:
    input:
        PATHS.everything,
        rules.complete_everything.input,
        rules.report_everything.input,
        embedding_files(REQUESTS),
