FEATURES_CODE = layer_hash(
    "features", "pipeline/extract_features.py", "pipeline/recordings.py"
)


rule features:
    input:
        lambda wildcards: SESSION_FILES[wildcards.dataset, wildcards.session],
    output:
        # Kept while the job runs: rows of unchanged recordings are used again. A file that Snakemake
        # restores after a failure looks new: the labels, which it deletes, make the job run again.
        shard=update(PATHS.shard("{dataset}", "{session}")),
        findings=update(PATHS.shard_findings("{dataset}", "{session}")),
        labels=PATHS.shard_labels("{dataset}", "{session}"),
    log:
        "results/logs/features/{dataset}.{session}.log",
    benchmark:
        "results/benchmarks/features/{dataset}.{session}.tsv"
    conda:
        "../../environment.yml"
    params:
        function="extract_features:extract_features",
        folder=str(PATHS.session("{dataset}", "{session}")),
        audio=setting("audio"),
        features=setting("features"),
        code=FEATURES_CODE,
    message:
        "Spectra of session {wildcards.session} of {wildcards.dataset}"
    script:
        "../scripts/run.py"


rule merge:
    input:
        shards=of_sessions(PATHS.shard),
        labels=of_sessions(PATHS.shard_labels),
        findings=of_sessions(PATHS.shard_findings),
    output:
        store=PATHS.features("{dataset}"),
        quarantine=PATHS.quarantine("{dataset}"),
    log:
        "results/logs/merge/{dataset}.log",
    benchmark:
        "results/benchmarks/merge/{dataset}.tsv"
    conda:
        "../../environment.yml"
    params:
        function="merge:merge",
        targets=setting("targets"),
        code=layer_hash("features", "pipeline/merge.py"),
    message:
        "Features and labels of {wildcards.dataset}"
    script:
        "../scripts/run.py"
