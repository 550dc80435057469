"""Run a job of rule `features`."""

from ajgdata.pipeline.extract_features import extract_features
from ajgdata.pipeline.log import run_job

run_job(extract_features, snakemake)
