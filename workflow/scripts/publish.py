"""Run a job of rule `publish_dataset`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.publish import publish

run_job(publish, snakemake)
