# Trains the encoders of one embedding.
rule embed:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
    output:
        latents=PATHS.latents("{dataset}", "{embedding}"),
        cost=PATHS.training_cost("{dataset}", "{embedding}"),
    log:
        "results/logs/embed/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/embed/{dataset}.{embedding}.tsv"
    priority: 1  # the training takes long, and experiments wait for it
    params:
        function="train:train_embedding",
        settings=embedding_settings,
        seed=config["seed"],
        device=config["device"],
        data=own_features,
        code=lambda wildcards: code_hash("embed"),
    message:
        "Training encoders for {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/run.py"
