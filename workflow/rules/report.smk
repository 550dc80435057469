# Ablations that the report draws on.
REASONS = list(ABLATED) if ABLATIONS_PAGE in PAGES else []


rule report:
    input:
        stores=[PATHS.features(name) for name in PLANS],
        quarantines=[PATHS.quarantine(name) for name in PLANS],
        tables=[PATHS.experiment(*key) for key in ASKED],
        costs=[PATHS.experiment_cost(*key) for key in ASKED],
        pages=[PATHS.page(name) for name in PAGES],
        ablations=[PATHS.ablation(name) for name in REASONS],
        trees=[PATHS.published_sums(name) for name in PUBLISHED],
        opening=rules.opening.output.folder if OPENING else [],
    output:
        page=PATHS.report,
        fixed=[PATHS.report.with_name(one.link) for one in FIXED.values()],
        runs=PATHS.runs,
        figures=directory(PATHS.report.parent / FIGURES),
        experiments=directory(PATHS.report.parent / EXPERIMENT_PAGES),
        tables=directory(PATHS.report.parent / TABLES),
    log:
        str(PATHS.log("report")),
    benchmark:
        str(PATHS.benchmark("report"))
    conda:
        "../../environment.yml"
    params:
        function="report:build_report",
        datasets=list(PLANS),
        tasks=MEASURED,
        run=PATHS.run,
        nav=NAVIGATION,
        pages=PAGES,
        ablations=REASONS,
        published=PUBLISHED,
        opening=str(PATHS.opening) if OPENING else None,
        declared=[settings_digest(one.spec) for one in PLANS.values()],
        code=layer_hash("report"),
        texts=REPORT_FILES,
    message:
        "Report on {params.datasets}"
    script:
        "../scripts/run.py"
