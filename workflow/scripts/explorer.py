"""Run a job of rule `explorer`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.pages import build_explorer

run_job(build_explorer, snakemake)
