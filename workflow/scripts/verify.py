"""Run a job of rule `verify`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.verify import verify

run_job(verify, snakemake)
