# One job trains all final models of a data set, so it imports heavy packages only once.
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
        "Training the final models of {wildcards.dataset}"
    script:
        "../scripts/run.py"
