"""Run a job of rule `merge`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.merge import merge

run_job(merge, snakemake)
