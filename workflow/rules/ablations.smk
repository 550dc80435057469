wildcard_constraints:
    ablation="|".join(ABLATED) or "-",


rule ablate:
    input:
        stores=lambda wildcards: [
            PATHS.merged(name) for name in ABLATIONS[wildcards.ablation].datasets
        ],
    output:
        tables=PATHS.ablation("{ablation}"),
    log:
        "results/logs/ablate/{ablation}.log",
    benchmark:
        "results/benchmarks/ablate/{ablation}.tsv"
    conda:
        "../../environment.yml"
    params:
        recipes=lambda wildcards: [
            settings_digest(PLANS[name].spec.recipe)
            for name in ABLATIONS[wildcards.ablation].datasets
        ],
        seed=config["seed"],
        quick=config["quick"],
        code=lambda wildcards: code_digest(*ablation_code(wildcards.ablation)),
    message:
        "Why simulation and paper differ: {wildcards.ablation}"
    script:
        "../scripts/ablate.py"


rule ablations_page:
    input:
        tables=[PATHS.ablation(name) for name in ABLATED],
    output:
        page=PATHS.page(ABLATIONS_PAGE),
        figures=directory(PATHS.page_figures(ABLATIONS_PAGE)),
    log:
        "results/logs/ablations_page.log",
    benchmark:
        "results/benchmarks/ablations_page.tsv"
    conda:
        "../../environment.yml"
    params:
        ablations=ABLATED,
        pages=PAGES,
        code=code_of("ajgdata.pipeline.pages:build_ablations_page"),
        texts=REPORT_FILES,
    message:
        "Page on why simulation and paper differ"
    script:
        "../scripts/ablations_page.py"
