"""Run a job of rule `complete`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.run_summary import complete

run_job(complete, snakemake)
