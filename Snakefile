# Recordings in, report out: `snakemake` runs everything that is not current.
from functools import partial
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version, validate

from ajgdata.paths import ABLATIONS_PAGE, FIGURES, RUNS_FILE, Paths
from ajgdata.pipeline.ablations import (
    ABLATIONS,
    ablation_code,
    possible,
)
from ajgdata.pipeline.experiments import (
    datasets_of,
    documents_of,
    experiments_of,
    runs_of,
)
from ajgdata.pipeline.inputs import Inputs
from ajgdata.pipeline.plan import plan, published, solved_by
from ajgdata.pipeline.studies import (
    EMBEDDING,
    GALLERY,
    GALLERY_CODE,
    STUDIES,
    TIMED,
    study_code,
)
from ajgdata.store.code_digest import code_digest
from ajgdata.store.files import read_yaml
from ajgdata.store.provenance import settings_digest
from ajgdata.store.report_files import report_files_digest
from ajgdata.types import DataError

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

PATHS = Paths()
REPORT_FILES = report_files_digest(PATHS)
# Jobs run what the main process has checked.
try:
    PLANS = plan(PATHS, config["datasets"], check=workflow.is_main_process)
    PUBLISHED = published(PLANS, config["publish"])
except DataError as error:
    raise SystemExit(str(error)) from None  # one line instead of a traceback
SPECS = {name: one.spec for name, one in PLANS.items()}
TASKS = [(name, task) for name, spec in SPECS.items() for task in spec.tasks]
EMBEDDINGS = [(name, one) for name, spec in SPECS.items() for one in spec.embeddings]
EXPERIMENTS = experiments_of(SPECS)
ABLATED = possible([name for name, one in PLANS.items() if one.virtual])
# Further pages: why simulation and paper differ, on embeddings, and on the virtual gripper.
PAGES = [EMBEDDING] if EMBEDDINGS else []
PAGES += [
    name
    for name in (*([ABLATIONS_PAGE] if ABLATED else []), GALLERY, *STUDIES)
    if config["pages"] is None or name in config["pages"]
]


wildcard_constraints:
    dataset="[A-Za-z0-9_-]+",
    session="[A-Za-z0-9_-]+",
    task="[A-Za-z0-9_-]+",
    embedding="[A-Za-z0-9_-]+",
    model="[a-z]+",


include: "workflow/rules/common.smk"


rule all:
    default_target: True
    input:
        PATHS.report,
        PATHS.all_metrics,
        of_runs(PATHS.model, TASKS),
        PATHS.results / "verify" / "summary.txt",
        [PATHS.receipt(name) for name in PUBLISHED],


include: "workflow/rules/acquire.smk"
include: "workflow/rules/features.smk"
include: "workflow/rules/evaluate.smk"
include: "workflow/rules/rows.smk"
include: "workflow/rules/embed.smk"
include: "workflow/rules/embed_page.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/ablations.smk"
include: "workflow/rules/gripper.smk"
include: "workflow/rules/publish.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/verify.smk"
