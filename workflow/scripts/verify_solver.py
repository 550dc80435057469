"""Run a job of rule `verify_solver`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.verify import verify_solver

run_job(verify_solver, snakemake)
