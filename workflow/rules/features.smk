FEATURE_CODE = code_digest("features", "store/audio", "store/features", "pipeline/shard")


rule features:
    message:
        "Spectra of session {wildcards.session} of {wildcards.dataset}"
    input:
        manifest=PATHS.audio_manifest("{dataset}", "{session}"),
    output:
        shard=PATHS.shard("{dataset}", "{session}"),
        findings=PATHS.shard_findings("{dataset}", "{session}"),
    params:
        root=str(PATHS.root),
        cache=str(PATHS.shard_cache("{dataset}", "{session}")),
        audio=lambda wildcards: PLANS[wildcards.dataset].spec.audio.model_dump(mode="json"),
        features=lambda wildcards: PLANS[wildcards.dataset].spec.features.model_dump(mode="json"),
        code=FEATURE_CODE,
    log:
        "results/logs/features/{dataset}.{session}.log",
    benchmark:
        "results/benchmarks/features/{dataset}.{session}.tsv"
    conda:
        "../../environment.yml"
    script:
        "../scripts/features.py"


def of_sessions(path):
    """All sessions of a data set, for one kind of file."""
    return lambda wildcards: [
        path(wildcards.dataset, session) for session in PLANS[wildcards.dataset].sessions
    ]


rule merge:
    message:
        "Features and labels of {wildcards.dataset}"
    input:
        shards=of_sessions(PATHS.shard),
        labels=of_sessions(PATHS.label_manifest),
        findings=of_sessions(PATHS.shard_findings),
    output:
        store=PATHS.features("{dataset}"),
        quarantine=PATHS.quarantine("{dataset}"),
    params:
        targets=lambda wildcards: {
            name: target.model_dump(mode="json")
            for name, target in PLANS[wildcards.dataset].spec.targets.items()
        },
        code=code_digest("store/labels", "store/features", "pipeline/merge"),
    log:
        "results/logs/merge/{dataset}.log",
    benchmark:
        "results/benchmarks/merge/{dataset}.tsv"
    conda:
        "../../environment.yml"
    script:
        "../scripts/merge.py"
