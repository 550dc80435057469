rule verify:
    input:
        runs=PATHS.runs,
        tests=HERE / "tests/artefacts/test_results.py",
    output:
        summary=PATHS.verified,
    log:
        str(PATHS.log("verify")),
    benchmark:
        str(PATHS.benchmark("verify"))
    conda:
        "../../environment.yml"
    params:
        function="verify:verify",
        run=PATHS.run,
        code=layer_hash("report"),
    message:
        "Checking the results"
    script:
        "../scripts/run.py"


# Minutes of runs too long for the test suite: they wait for no result, so that the end of a run
# does not wait for them.
rule verify_solver:
    input:
        tests=HERE / "tests/verification/test_cases.py",
    output:
        summary=PATHS.verified_solver,
    log:
        "results/logs/verify_solver.log",
    benchmark:
        "results/benchmarks/verify_solver.tsv"
    priority: 1  # minutes of one core: begun last, the run would wait for it
    conda:
        "../../environment.yml"
    params:
        function="verify:verify_solver",
        code=layer_hash("studies", "pipeline/verify.py"),
    message:
        "Checking the solver on runs too long for the test suite"
    script:
        "../scripts/run.py"


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
        "Was everything made that was asked for?"
    script:
        "../scripts/run.py"
