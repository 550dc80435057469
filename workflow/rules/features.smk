FEATURES_CODE = layer_hash(
    "features", "pipeline/extract_features.py", "pipeline/recordings.py"
)


rule features:
    input:
        manifest=of_session(PATHS.audio_manifest),
    output:
        shard=PATHS.shard("{dataset}", "{session}"),
        findings=PATHS.shard_findings("{dataset}", "{session}"),
    log:
        "results/logs/features/{dataset}.{session}.log",
    benchmark:
        "results/benchmarks/features/{dataset}.{session}.tsv"
    priority: first_results
    conda:
        "../../environment.yml"
    params:
        audio=setting("audio"),
        features=setting("features"),
        code=FEATURES_CODE,
    message:
        "Spectra of session {wildcards.session} of {wildcards.dataset}"
    script:
        "../scripts/features.py"


rule merge:
    input:
        shards=of_sessions(PATHS.shard),
        labels=of_sessions(PATHS.label_manifest),
        findings=of_sessions(PATHS.shard_findings),
    output:
        store=PATHS.merged("{dataset}"),
        quarantine=PATHS.quarantine("{dataset}"),
    log:
        "results/logs/merge/{dataset}.log",
    benchmark:
        "results/benchmarks/merge/{dataset}.tsv"
    priority: first_results
    conda:
        "../../environment.yml"
    params:
        targets=setting("targets"),
        code=layer_hash("features", "pipeline/merge.py"),
    message:
        "Features and labels of {wildcards.dataset}"
    script:
        "../scripts/merge.py"


# Asked for by name alone: whoever wants the features and nothing else. Never deleted beforehand,
# since somebody may be reading it.
rule store:
    input:
        ancient(rules.merge.output.store),  # merging links it itself
    output:
        update(PATHS.features("{dataset}")),
    log:
        "results/logs/store/{dataset}.log",
    conda:
        "../../environment.yml"
    message:
        "Features of {wildcards.dataset}, as people load them"
    script:
        "../scripts/store.py"
