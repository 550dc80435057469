"""Run a job of rule `page`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.pages import build_page

run_job(build_page, snakemake)
