# Pages beside the report: why simulation and paper differ, and those on the virtual gripper.
wildcard_constraints:
    study="|".join(STUDIES),
    ablation="|".join(ABLATED) or "-",
    page="|".join([ABLATIONS_PAGE, *STUDIES]),


rule study:
    output:
        tables=PATHS.study("{study}"),
    log:
        "results/logs/study/{study}.log",
    benchmark:
        "results/benchmarks/study/{study}.tsv"
    conda:
        "../../environment.yml"
    params:
        function="studies:run_study",
        quick=config["quick"],
        tests=str(HERE / "tests/verification"),
        code=study_hash(
            *map(str, (HERE / "tests/verification/known_cases").glob("*.py"))
        ),
    message:
        "Studying the virtual gripper: {wildcards.study}"
    script:
        "../scripts/run.py"


rule ablate:
    input:
        stores=lambda wildcards: [
            PATHS.features(name) for name in ABLATED[wildcards.ablation].datasets
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
        function="studies:run_ablation",
        recipes=lambda wildcards: [
            settings_digest(PLANS[name].spec.recipe, PLANS[name].spec.excitation)
            for name in ABLATED[wildcards.ablation].datasets
        ],
        settings=lambda wildcards: settings_digest(ABLATED[wildcards.ablation]),
        seed=config["seed"],
        device=config["device"],
        code=ablation_hash(),
    message:
        "Why simulation and paper differ: {wildcards.ablation}"
    script:
        "../scripts/run.py"


rule page:
    input:
        files=page_tables,
    output:
        page=PATHS.page("{page}"),
        figures=directory(PATHS.page_figures("{page}")),
    log:
        "results/logs/page/{page}.log",
    benchmark:
        "results/benchmarks/page/{page}.tsv"
    conda:
        "../../environment.yml"
    params:
        function="pages:build_page",
        name="{page}",
        nav=NAVIGATION,
        code=layer_hash("report"),
        texts=REPORT_FILES,
    message:
        "Page on {wildcards.page}"
    script:
        "../scripts/run.py"


# The opening picture of the report: a simulated grasp and its prediction.
if OPENING:

    rule opening:
        input:
            store=PATHS.features(OPENING),
            tables=PATHS.experiment(OPENING, OBJECT, OPENING_KIND),
        output:
            folder=directory(PATHS.opening.parent),
        log:
            "results/logs/opening.log",
        benchmark:
            "results/benchmarks/opening.tsv"
        conda:
            "../../environment.yml"
        params:
            function="opening:build_opening",
            audio=SPECS[OPENING].audio.model_dump(mode="json"),
            code=layer_hash("report"),
        message:
            "The gripper in pictures"
        script:
            "../scripts/run.py"
