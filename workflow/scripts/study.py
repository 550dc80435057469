"""Run a job of rule `study`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.studies import run_study

run_job(run_study, snakemake)
