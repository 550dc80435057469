# Measurements on the simulation: studies, and ablations on why simulation and paper differ.
wildcard_constraints:
    study="|".join(STUDIES),
    ablation="|".join(ABLATED) or "-",


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
        code=lambda wildcards: code_hash("study"),
    message:
        "Studying the virtual gripper: {wildcards.study}"
    script:
        "../scripts/run.py"


rule ablate:
    input:
        stores=lambda wildcards: [
            PATHS.features(name) for name in ABLATED[wildcards.ablation].datasets
        ],
        hashes=lambda wildcards: [
            PATHS.session_hashes(name) for name in ABLATED[wildcards.ablation].datasets
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
        data=lambda wildcards: features_of(*ABLATED[wildcards.ablation].datasets),
        settings=lambda wildcards: settings_digest(ABLATED[wildcards.ablation]),
        seed=config["seed"],
        device=config["device"],
        code=lambda wildcards: code_hash("ablation"),
    message:
        "Why simulation and paper differ: {wildcards.ablation}"
    script:
        "../scripts/run.py"


# The opening picture of the report: a simulated grasp and its prediction.
if OPENING:

    rule opening:
        input:
            store=PATHS.features(OPENING),
            hashes=PATHS.session_hashes(OPENING),
            tables=PATHS.experiment(OPENING, OBJECT, *SHOWN_RESULT),
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
            data=lambda wildcards: features_of(OPENING),
            code=lambda wildcards: code_hash("opening"),
        message:
            "The gripper in pictures"
        script:
            "../scripts/run.py"
