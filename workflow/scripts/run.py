"""Run a job of any rule: the function of the rule gets the job's inputs, outputs and params."""

from ajgdata.pipeline.jobs import run_job

# Other processes of a job import this file as well.
if __name__ == "__main__":
    run_job(snakemake)
