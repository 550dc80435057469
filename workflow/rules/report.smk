def of_runs(path):
    """All evaluated models, for one kind of file."""
    return [path(*run) for run in RUNS]


rule report:
    message:
        "Report on {params.datasets}"
    input:
        stores=[PATHS.features(name) for name in PLANS],
        quarantines=[PATHS.quarantine(name) for name in PLANS],
        metrics=of_runs(PATHS.metrics),
        costs=of_runs(PATHS.cost),
        predictions=of_runs(PATHS.predictions),
    output:
        page=PATHS.report,
        figures=directory(PATHS.report.parent / "figures"),
    params:
        root=str(PATHS.root),
        datasets=list(PLANS),
        runs=RUNS,
        declared=[settings_digest(one.spec) for one in PLANS.values()],
        code=code_digest("report", "pipeline/report"),
    log:
        "results/logs/report.log",
    benchmark:
        "results/benchmarks/report.tsv"
    conda:
        "../../environment.yml"
    script:
        "../scripts/report.py"
