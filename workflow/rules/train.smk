# Trains one final model of a task on all recordings.
rule train:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
        equal=equal_model,
        noise=lambda wildcards: [PATHS.features(name) for name in noise_sets(wildcards)],
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
        audio=setting("audio"),
        features=setting("features"),
        seed=config["seed"],
        device=config["device"],
        data=lambda wildcards: features_of(wildcards.dataset, *noise_sets(wildcards)),
        code=training_code,
    message:
        "Training {wildcards.model} for {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/run.py"
