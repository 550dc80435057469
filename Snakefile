# Recordings in, report out: `snakemake` runs everything that is not current.
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.utils import min_version, validate

from ajgdata.paths import Paths
from ajgdata.pipeline.plan import plan
from ajgdata.pipeline.studies import GALLERY, GALLERY_CODE, STUDIES, STUDY_CODE, TIMED
from ajgdata.store.provenance import code_digest, settings_digest
from ajgdata.types import DataError

min_version("9.10")

HERE = Path(workflow.basedir)


configfile: HERE / "workflow/config/default.yaml"


try:
    validate(config, str(HERE / "workflow/schemas/config.schema.yaml"))
except WorkflowError as error:  # one line instead of the whole schema
    wrong = error.__context__
    raise SystemExit(
        f"config{wrong.json_path[1:]}: {wrong.message}; correct it"
    ) from None

PATHS = Paths()
# Only the main process looks at the recordings; its jobs see the manifests that it left.
try:
    PLANS = plan(PATHS, config["datasets"], refresh=workflow.is_main_process)
except DataError as error:
    raise SystemExit(str(error)) from None  # one line instead of a traceback
TASKS = [(name, *one) for name, p in PLANS.items() for one in p.spec.tasks.items()]
RUNS = [(dataset, task, m) for dataset, task, one in TASKS for m in one.models]
CURVES = [(d, task, m) for d, task, one in TASKS if one.curve for m in one.curve.models]
SORTED = [
    (d, task, m) for d, task, one in TASKS if one.sorting for m in one.sorting.models
]
STFTS = [(dataset, task) for dataset, task, one in TASKS if one.stft]
PERMUTED = [(dataset, task) for dataset, task, one in TASKS if one.permutations]
# Pages on the virtual gripper.
PAGES = [
    name
    for name in (GALLERY, *STUDIES)
    if config["pages"] is None or name in config["pages"]
]


wildcard_constraints:
    dataset="[A-Za-z0-9_-]+",
    session="[A-Za-z0-9_-]+",
    task="[A-Za-z0-9_-]+",
    model="[a-z]+",


rule all:
    default_target: True
    input:
        PATHS.report,
        PATHS.all_metrics,
        [PATHS.model(*run) for run in RUNS],
        PATHS.results / "verify" / "summary.txt",


include: "workflow/rules/common.smk"
include: "workflow/rules/acquire.smk"
include: "workflow/rules/features.smk"
include: "workflow/rules/evaluate.smk"
include: "workflow/rules/rows.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/gripper.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/verify.smk"
