rule evaluate:
    input:
        store=PATHS.merged("{dataset}"),
        others=lambda wildcards: [
            PATHS.merged(other)
            for other in PLANS[wildcards.dataset].spec.tasks[wildcards.task].test_on
        ],
    output:
        metrics=PATHS.metrics("{dataset}", "{task}", "{model}"),
        cost=PATHS.cost("{dataset}", "{task}", "{model}"),
        predictions=PATHS.predictions("{dataset}", "{task}", "{model}"),
    log:
        "results/logs/evaluate/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/evaluate/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    params:
        task=lambda wildcards: PLANS[wildcards.dataset].spec.evaluation(wildcards.task),
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.evaluate:evaluate_task"),
    message:
        "Cross-validating {wildcards.model} on {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/evaluate.py"


rule stft:
    input:
        store=PATHS.merged("{dataset}"),
        manifests=of_sessions(PATHS.audio_manifest),
    output:
        document=PATHS.stft("{dataset}", "{task}"),
        cost=PATHS.stft_cost("{dataset}", "{task}"),
    log:
        "results/logs/stft/{dataset}.{task}.log",
    benchmark:
        "results/benchmarks/stft/{dataset}.{task}.tsv"
    conda:
        "../../environment.yml"
    params:
        root=str(PATHS.root),
        task=lambda wildcards: PLANS[wildcards.dataset].spec.experiment(wildcards.task),
        audio=lambda wildcards: PLANS[wildcards.dataset].spec.audio.model_dump(
            mode="json"
        ),
        settings=lambda wildcards: [
            one.model_dump(mode="json")
            for one in PLANS[wildcards.dataset].spec.feature_variants(wildcards.task)
        ],
        models=lambda wildcards: list(declared(wildcards).stft.models),
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.stft:stft_task"),
    message:
        "Settings of the STFT on {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/stft.py"
