# All models of a data set in one job: what trains them is imported once.
rule train:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
    output:
        folder=directory(PATHS.models("{dataset}")),
    log:
        "results/logs/train/{dataset}.log",
    benchmark:
        "results/benchmarks/train/{dataset}.tsv"
    conda:
        "../../environment.yml"
    params:
        function="train:train_models",
        tasks=trainings,
        seed=config["seed"],
        device=config["device"],
        data=own_features,
        code=lambda wildcards: code_hash("train"),
    message:
        "Training every model of {wildcards.dataset} on all of it"
    script:
        "../scripts/run.py"
