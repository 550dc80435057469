rule embed:
    input:
        store=PATHS.features("{dataset}"),
    output:
        latents=PATHS.latents("{dataset}", "{embedding}"),
        cost=PATHS.training_cost("{dataset}", "{embedding}"),
    log:
        "results/logs/embed/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/embed/{dataset}.{embedding}.tsv"
    priority: 1  # of what takes longest; experiments wait for it
    conda:
        "../../environment.yml"
    params:
        function="embed:train_embedding",
        settings=embedding_settings,
        seed=config["seed"],
        code=layer_hash("evaluate", "pipeline/embed.py"),
    message:
        "Training encoders for {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/run.py"


rule explorer:
    input:
        projections=PATHS.experiment("{dataset}", "{embedding}", PROJECTIONS),
    output:
        page=PATHS.explorer("{dataset}", "{embedding}"),
    log:
        "results/logs/explorer/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/explorer/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        function="pages:build_explorer",
        code=layer_hash("report"),
        declared=lambda wildcards: settings_digest(SPECS[wildcards.dataset]),
        nav=NAVIGATION,
        run=PATHS.run,
        texts=REPORT_FILES,
    message:
        "Scatter plot of {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/run.py"
