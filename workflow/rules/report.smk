rule report:
    input:
        stores=[PATHS.merged(name) for name in PLANS],
        quarantines=[PATHS.quarantine(name) for name in PLANS],
        metrics=of_runs(PATHS.metrics),
        costs=of_runs(PATHS.cost),
        predictions=of_runs(PATHS.predictions),
        curves=[PATHS.curve(*run) for run in CURVES],
        permutations=[PATHS.permutations(*task) for task in PERMUTED],
        stfts=[[PATHS.stft(*task), PATHS.stft_cost(*task)] for task in STFTS],
        sorting=[PATHS.sorting(*run) for run in SORTED],
        pages=[PATHS.page(name) for name in PAGES],
    output:
        page=PATHS.report,
        runs=PATHS.runs,
        figures=directory(PATHS.report.parent / "figures"),
    log:
        "results/logs/report.log",
    benchmark:
        "results/benchmarks/report.tsv"
    conda:
        "../../environment.yml"
    params:
        root=str(PATHS.root),
        datasets=list(PLANS),
        runs=RUNS,
        pages=PAGES,
        declared=[settings_digest(one.spec) for one in PLANS.values()],
        code=code_digest("report", "pipeline/report"),
    message:
        "Report on {params.datasets}"
    script:
        "../scripts/report.py"
