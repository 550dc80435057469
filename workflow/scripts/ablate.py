"""Run a job of rule `ablate`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.studies import run_ablation

run_job(run_ablation, snakemake)
