# The last job of a whole run. If a task was skipped, `end_run` removes the summary and sets exit
# code 1.
rule complete:
    input:
        EVERYTHING,
    output:
        summary=PATHS.complete,
    log:
        str(PATHS.log("complete")),
    conda:
        "../../environment.yml"
    params:
        function="run_summary:complete",
        datasets=list(PLANS),
        run=PATHS.run,
        optional=[
            f"{name}/{task}"
            for name, task in MEASURED
            if {**SPECS[name].tasks, **SPECS[name].embeddings}[task].optional
        ],
        code=layer_hash("report"),
    message:
        "Summary of the run"
    script:
        "../scripts/run.py"
