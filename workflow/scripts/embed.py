"""Run a job of rule `embed`."""

from ajgdata.pipeline.embed import train_embedding
from ajgdata.pipeline.log import run_job

run_job(train_embedding, snakemake)
