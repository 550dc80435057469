# Trains one final model of a task on all recordings.
rule train:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
        equal=equal_model,
    output:
        folder=directory(PATHS.model("{dataset}", "{task}", "{model}")),
    log:
        "results/logs/train/{dataset}/{task}/{model}.log",
    benchmark:
        "results/benchmarks/train/{dataset}/{task}/{model}.tsv"
    priority: lambda wildcards: int("cnn" in wildcards.model)  # networks take longest
    params:
        function="train:train_final_model",
        settings=training_settings,
        seed=config["seed"],
        device=config["device"],
        data=own_features,
        code=lambda wildcards: code_hash("train"),
    message:
        "Training {wildcards.model} for {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/run.py"
