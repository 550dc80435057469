# Collects the metrics and predictions of all results that exist, without the report.
rule collect:
    input:
        tables=[PATHS.experiment(*key) for key in FIRST],
        costs=[PATHS.experiment_cost(*key) for key in FIRST],
    output:
        metrics=report(
            PATHS.metrics_table, caption="../report/metrics.rst", category="Tables"
        ),
        predictions=report(
            PATHS.predictions, caption="../report/predictions.rst", category="Tables"
        ),
    log:
        str(PATHS.log("collect")),
    benchmark:
        str(PATHS.benchmark("collect"))
    # This job is before the report, so metrics exist even if the report fails.
    priority: 2
    params:
        function="collect:collect",
        datasets=list(PLANS),
        tasks=MEASURED,
        results=RESULTS,
        run=PATHS.run,
        code=lambda wildcards: code_hash("collect"),
    message:
        "Metrics and predictions"
    script:
        "../scripts/run.py"


# The same tables, written again when all results exist.
use rule collect as collect_everything with:
    input:
        metrics=PATHS.metrics_table,
        tables=[PATHS.experiment(*key) for key in REQUESTS],
        costs=[PATHS.experiment_cost(*key) for key in REQUESTS],
    output:
        touch(PATHS.metrics_of_everything),
    log:
        str(PATHS.log("collect_everything")),
    benchmark:
        str(PATHS.benchmark("collect_everything"))
    message:
        "Metrics and predictions of all results"


# The report shows all results that exist. For the target `all`, it needs the results of the paper.
rule report:
    input:
        stores=[PATHS.features(name) for name in FIRST_DATASETS],
        quarantines=[PATHS.quarantine(name) for name in FIRST_DATASETS],
        hashes=[PATHS.session_hashes(name) for name in FIRST_DATASETS],
        tables=[PATHS.experiment(*key) for key in FIRST],
        costs=[PATHS.experiment_cost(*key) for key in FIRST],
        studies=[PATHS.study(name) for name in REQUESTED_STUDIES if name in PAGES],
        opening=rules.opening.output.folder if OPENING else [],
    output:
        page=PATHS.report,
        fixed=[PATHS.report.with_name(page.link) for page in FIXED.values()],
        runs=PATHS.runs,
        figures=report(
            directory(PATHS.report.parent / FIGURES_FOLDER),
            patterns=["{figure}.svg"],
            caption="../report/figures.rst",
            category="Figures",
            labels={"figure": "{figure}"},
        ),
        experiments=directory(PATHS.report.parent / EXPERIMENT_PAGES_FOLDER),
        tables=directory(PATHS.report.parent / TABLES_FOLDER),
    log:
        str(PATHS.log("report")),
    benchmark:
        str(PATHS.benchmark("report"))
    params:
        function="report:build_report",
        datasets=list(PLANS),
        tasks=MEASURED,
        run=PATHS.run,
        studies=[name for name in STUDIES if name in PAGES],
        published=PUBLISHED,
        declared=[settings_digest(item.spec) for item in PLANS.values()],
        code=report_code,
        texts=REPORT_FILES,
        requested=FIRST_RESULTS,
        data=lambda wildcards: features_of(*FIRST_DATASETS),
    message:
        "Report"
    script:
        "../scripts/run.py"


# The same report, written again when all results exist.
use rule report as report_everything with:
    input:
        report=PATHS.report,
        metrics=PATHS.metrics_of_everything,
        stores=[PATHS.features(name) for name in PLANS],
        quarantines=[PATHS.quarantine(name) for name in PLANS],
        hashes=[PATHS.session_hashes(name) for name in PLANS],
        tables=[PATHS.experiment(*key) for key in REQUESTS],
        costs=[PATHS.experiment_cost(*key) for key in REQUESTS],
        studies=[PATHS.study(name) for name in STUDIES if name in PAGES],
        published=[PATHS.published_sums(name) for name in PUBLISHED],
    output:
        touch(PATHS.report_on_everything),
    log:
        str(PATHS.log("report_everything")),
    benchmark:
        str(PATHS.benchmark("report_everything"))
    params:
        requested=RESULTS,
        data=lambda wildcards: features_of(*PLANS),
    message:
        "Report on all results"
