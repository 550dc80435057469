# Ablations that the report draws on.
REASONS = list(ABLATED) if ABLATIONS_PAGE in PAGES else []


rule report:
    input:
        stores=[PATHS.features(name) for name in PLANS],
        quarantines=[PATHS.quarantine(name) for name in PLANS],
        tables=of_experiments(PATHS.experiment, MEASURED),
        costs=of_experiments(PATHS.experiment_cost, MEASURED),
        explorers=of_latents(PATHS.explorer),
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
        datasets=list(PLANS),
        tasks=MEASURED,
        run=PATHS.run,
        nav=NAVIGATION,
        pages=PAGES,
        ablations=REASONS,
        published=PUBLISHED,
        opening=bool(OPENING),
        declared=[settings_digest(one.spec) for one in PLANS.values()],
        code=layer_hash("report"),
        packages=sorted({p for key in ASKED for p in packages_of(ASKED[key], key[2])}),
        texts=REPORT_FILES,
    message:
        "Report on {params.datasets}"
    script:
        "../scripts/report.py"


use rule report as report_alone with:
    input:
        stores=part(partial(data_of, PATHS.features)),
        quarantines=part(partial(data_of, PATHS.quarantine)),
        tables=part(partial(of_experiments, PATHS.experiment)),
        costs=part(partial(of_experiments, PATHS.experiment_cost)),
    output:
        page=PATHS.report_on("{report}"),
        fixed=[
            PATHS.report_on("{report}").with_name(one.link) for one in FIXED.values()
        ],
        runs=PATHS.report_on("{report}").with_name(RUNS_FILE),
        figures=directory(PATHS.report_on("{report}").parent / FIGURES),
        experiments=directory(PATHS.report_on("{report}").parent / EXPERIMENT_PAGES),
        tables=directory(PATHS.report_on("{report}").parent / TABLES),
    log:
        "results/logs/report_alone/{report}.log",
    benchmark:
        "results/benchmarks/report_alone/{report}.tsv"
    wildcard_constraints:
        report="|".join(REPORTS) or "-",
    params:
        datasets=part(partial(datasets_of, SPECS)),
        tasks=part(list),
        nav=part(lambda tasks: plain(navigation_of(PATHS, SPECS, tasks, []))),
        pages=[],
        ablations=[],
        published=[],
        opening=False,
        declared=part(partial(data_of, lambda name: settings_digest(SPECS[name]))),
    message:
        "Report on {wildcards.report} alone"


# `snakemake report_size`: that experiment, and nothing that it does not need.
for name in REPORTS:

    rule:
        name:
            f"report_{name}"
        input:
            PATHS.report_on(name),
