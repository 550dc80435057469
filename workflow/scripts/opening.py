"""Run a job of rule `opening`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.opening import build_opening

run_job(build_opening, snakemake)
