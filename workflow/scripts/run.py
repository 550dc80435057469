"""Run a job of any rule: the function of the rule gets the job's inputs, outputs and params."""

from ajgdata.pipeline.jobs import run_job

run_job(snakemake)
