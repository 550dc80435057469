rule publish:
    input:
        [PATHS.receipt(name) for name in PUBLISHED],


rule publish_dataset:
    input:
        store=PATHS.merged("{dataset}"),
        quarantine=PATHS.quarantine("{dataset}"),
        audio=of_sessions(PATHS.audio_manifest),
        lost=lambda wildcards: INPUTS.lost_tree(wildcards.dataset),
    output:
        receipt=PATHS.receipt("{dataset}"),
    log:
        "results/logs/publish/{dataset}.log",
    benchmark:
        "results/benchmarks/publish/{dataset}.tsv"
    conda:
        "../../environment.yml"
    params:
        declared=lambda wildcards: settings_digest(SPECS[wildcards.dataset]),
        texts=report_files_digest(PATHS, "templates/card.md.j2"),
        code=layer_hash("report"),
    message:
        "Publishing {wildcards.dataset}"
    script:
        "../scripts/publish.py"
