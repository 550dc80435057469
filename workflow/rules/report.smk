# Ablations that the report draws on.
REASONS = ABLATED if ABLATIONS_PAGE in PAGES else []


rule report:
    input:
        stores=[PATHS.merged(name) for name in PLANS],
        quarantines=[PATHS.quarantine(name) for name in PLANS],
        metrics=of_runs(PATHS.metrics, TASKS),
        costs=of_runs(PATHS.cost, TASKS),
        predictions=of_runs(PATHS.predictions, TASKS),
        documents=of_experiments(TASKS),
        embeddings=of_embeddings(EMBEDDINGS),
        projections=of_pictures(PATHS.projections),
        pages=[PATHS.page(name) for name in PAGES],
        ablations=[PATHS.ablation(name) for name in REASONS],
        trees=[PATHS.receipt(name) for name in PUBLISHED],
    output:
        page=PATHS.report,
        runs=PATHS.runs,
        figures=directory(PATHS.report.parent / FIGURES),
    log:
        "results/logs/report.log",
    benchmark:
        "results/benchmarks/report.tsv"
    conda:
        "../../environment.yml"
    params:
        datasets=list(PLANS),
        tasks=TASKS,
        embeddings=EMBEDDINGS,
        pages=PAGES,
        ablations=REASONS,
        published=PUBLISHED,
        declared=[settings_digest(one.spec) for one in PLANS.values()],
        code=code_of("ajgdata.pipeline.report:build_report"),
        texts=REPORT_FILES,
    message:
        "Report on {params.datasets}"
    script:
        "../scripts/report.py"


use rule report as experiment with:
    input:
        stores=part(partial(data_of, PATHS.merged)),
        quarantines=part(partial(data_of, PATHS.quarantine)),
        metrics=part(partial(of_runs, PATHS.metrics)),
        costs=part(partial(of_runs, PATHS.cost)),
        predictions=part(partial(of_runs, PATHS.predictions)),
        documents=part(of_experiments),
    output:
        page=PATHS.report_on("{experiment}"),
        runs=PATHS.report_on("{experiment}").with_name(RUNS_FILE),
        figures=directory(PATHS.report_on("{experiment}").parent / FIGURES),
    log:
        "results/logs/experiment/{experiment}.log",
    benchmark:
        "results/benchmarks/experiment/{experiment}.tsv"
    wildcard_constraints:
        experiment="|".join(EXPERIMENTS) or "-",
    params:
        datasets=part(partial(datasets_of, SPECS)),
        tasks=part(list),
        embeddings=[],
        pages=[],
        ablations=[],
        published=[],
        declared=part(partial(data_of, lambda name: settings_digest(SPECS[name]))),
    message:
        "Report on experiment {wildcards.experiment}"


# `snakemake report_size`: that experiment, and nothing that it does not need.
for experiment in EXPERIMENTS:

    rule:
        name:
            f"report_{experiment}"
        input:
            PATHS.report_on(experiment),
