"""Run a job of rule `report`."""

from ajgdata.pipeline.log import run_job
from ajgdata.pipeline.report import build_report

run_job(build_report, snakemake)
