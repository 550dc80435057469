"""Run a job of rule `experiment`."""

from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.log import run_job

run_job(run_experiment, snakemake)
