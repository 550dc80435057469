"""Run a job of rule `train`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.train import train_models

run_job(train_models, snakemake)
