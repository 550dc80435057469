rule embed:
    input:
        store=PATHS.merged("{dataset}"),
    output:
        latents=PATHS.latents("{dataset}", "{embedding}"),
        cost=PATHS.embedding_document("{dataset}", "{embedding}", "cost"),
    log:
        "results/logs/embed/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/embed/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="train_embedding",
        settings=embedding_settings,
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.embed:train_embedding"),
    message:
        "Training encoders for {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/embed.py"


rule embed_knn:
    input:
        store=PATHS.merged("{dataset}"),
        latents=rules.embed.output.latents,
        training_cost=rules.embed.output.cost,
    output:
        output=PATHS.embedding_document("{dataset}", "{embedding}", "knn"),
        cost=PATHS.embedding_document("{dataset}", "{embedding}", "knn_cost"),
    log:
        "results/logs/embed_knn/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/embed_knn/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="knn_task",
        settings=embedding_settings,
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.embed_measures:knn_task"),
    message:
        "k-NN on {wildcards.embedding} of {wildcards.dataset}, and on PCA and UMAP"
    script:
        "../scripts/embed.py"


rule embed_measure:
    input:
        store=PATHS.merged("{dataset}"),
        latents=rules.embed.output.latents,
    output:
        distances=PATHS.embedding_document("{dataset}", "{embedding}", "distances"),
        probes=PATHS.embedding_document("{dataset}", "{embedding}", "probes"),
        retrieval=PATHS.embedding_document("{dataset}", "{embedding}", "retrieval"),
    log:
        "results/logs/embed_measure/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/embed_measure/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="measure_task",
        settings=embedding_settings,
        kinds=lambda wildcards: PLANS[wildcards.dataset].spec.kinds,
        code=code_of("ajgdata.pipeline.embed_measures:measure_task"),
    message:
        "Distances, probes and retrieval in {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/embed.py"


rule transfer:
    input:
        store=PATHS.merged("{dataset}"),
        base=lambda wildcards: PATHS.merged(declared_embedding(wildcards).base),
    output:
        output=PATHS.embedding_document("{dataset}", "{embedding}", "transfer"),
        cost=PATHS.embedding_document("{dataset}", "{embedding}", "transfer_cost"),
    log:
        "results/logs/transfer/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/transfer/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="transfer_task",
        settings=embedding_settings,
        kinds=lambda wildcards: PLANS[wildcards.dataset].spec.kinds,
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.embed_transfer:transfer_task"),
    message:
        "From gripper to gripper, in {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/embed.py"
