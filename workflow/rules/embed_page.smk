rule embed_projections:
    input:
        store=PATHS.merged("{dataset}"),
        latents=rules.embed.output.latents,
    output:
        output=PATHS.projections("{dataset}", "{embedding}"),
    log:
        "results/logs/embed_projections/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/embed_projections/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="make_projections",
        settings=embedding_settings,
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.projections:make_projections"),
    message:
        "Projecting {wildcards.embedding} of {wildcards.dataset}"
    script:
        "../scripts/embed.py"


rule explorer:
    input:
        store=PATHS.merged("{dataset}"),
        projections=rules.embed_projections.output.output,
        manifests=of_sessions(PATHS.audio_manifest),
    output:
        page=PATHS.explorer("{dataset}", "{embedding}"),
    log:
        "results/logs/explorer/{dataset}.{embedding}.log",
    benchmark:
        "results/benchmarks/explorer/{dataset}.{embedding}.tsv"
    conda:
        "../../environment.yml"
    params:
        root=str(PATHS.root),
        code=code_of("ajgdata.pipeline.embed_page:build_explorer"),
        texts=REPORT_FILES,
    message:
        "Every recording of {wildcards.dataset}, seen and heard"
    script:
        "../scripts/embed_page.py"


rule report_embedding:
    input:
        stores=[PATHS.merged(dataset) for dataset in dict(EMBEDDINGS)],
        documents=of_embeddings(EMBEDDINGS),
        projections=of_pictures(PATHS.projections),
        explorers=of_pictures(PATHS.explorer),
    output:
        page=PATHS.page(EMBEDDING),
        figures=directory(PATHS.page_figures(EMBEDDING)),
    log:
        "results/logs/report_embedding.log",
    benchmark:
        "results/benchmarks/report_embedding.tsv"
    conda:
        "../../environment.yml"
    params:
        root=str(PATHS.root),
        embeddings=EMBEDDINGS,
        pages=PAGES,
        code=code_of("ajgdata.pipeline.embed_page:build_embedding_page"),
        texts=REPORT_FILES,
    message:
        "Page on embeddings"
    script:
        "../scripts/embed_page.py"
