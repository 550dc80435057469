from ajgdata.types import MODELS


rule train:
    input:
        store=PATHS.merged("{dataset}"),
    output:
        folder=directory(PATHS.model("{dataset}", "{task}", "{model}")),
    log:
        "results/logs/train/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/train/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    params:
        task=lambda wildcards: SPECS[wildcards.dataset].training(wildcards.task),
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.train:train_model"),
        registered_by=lambda wildcards: MODELS.origin(wildcards.model),
    message:
        "Training {wildcards.model} for {wildcards.task} on all of {wildcards.dataset}"
    script:
        "../scripts/train.py"
