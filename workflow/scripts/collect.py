"""Run a job of rule `collect`."""

from ajgdata.pipeline.collect import collect
from ajgdata.pipeline.log import run_job

run_job(collect, snakemake)
