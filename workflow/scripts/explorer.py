"""Run a job of rule `explorer`."""

from ajgdata.pipeline.explorer import build_explorer
from ajgdata.pipeline.log import run_job

run_job(build_explorer, snakemake)
