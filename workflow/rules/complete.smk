# The last job of the target `all` writes the summary. If a task was skipped or a result could not be
# read, `end_run` removes the summary and sets exit code 1.
rule complete:
    input:
        runs=PATHS.runs,
        metrics=PATHS.metrics_table,
        models=[] if PAPER else [PATHS.model(*key) for key in FINAL_MODELS],
        files=[
            *rules.report.input.tables,
            *rules.report.input.costs,
            *rules.report.input.studies,
        ],
    output:
        summary=PATHS.complete,
    log:
        str(PATHS.log("complete")),
    params:
        function="run_summary:complete",
        datasets=FIRST_DATASETS,
        requested=FIRST_RESULTS,
        trained=[] if PAPER else FINAL_MODELS,
        run=PATHS.run,
        optional=[
            f"{name}/{task}"
            for name, task in MEASURED
            if {**SPECS[name].tasks, **SPECS[name].embeddings}[task].optional
        ],
        code=report_code,
    message:
        "Summary of the run"
    script:
        "../scripts/run.py"


# The last job of the target `everything`.
use rule complete as complete_everything with:
    input:
        report=PATHS.report_on_everything,
        models=[PATHS.model(*key) for key in FINAL_MODELS],
        files=[
            *rules.report_everything.input.tables,
            *rules.report_everything.input.costs,
            *rules.report_everything.input.studies,
        ],
    output:
        summary=PATHS.everything,
    log:
        str(PATHS.log("complete_everything")),
    params:
        datasets=list(PLANS),
        requested=RESULTS,
        trained=FINAL_MODELS,
