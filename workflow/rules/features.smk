FEATURE_CODE = code_digest(
    "features",
    "store/audio",
    "store/conversion",
    "store/riff",
    "store/features",
    "store/findings",
    "pipeline/recordings",
    "pipeline/extract_features",
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
    conda:
        "../../environment.yml"
    params:
        root=str(PATHS.root),
        cache=str(PATHS.shard_cache("{dataset}", "{session}")),
        audio=lambda wildcards: PLANS[wildcards.dataset].spec.audio.model_dump(
            mode="json"
        ),
        features=lambda wildcards: PLANS[wildcards.dataset].spec.features.model_dump(
            mode="json"
        ),
        code=FEATURE_CODE,
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
    conda:
        "../../environment.yml"
    params:
        published=lambda wildcards: str(PATHS.features(wildcards.dataset)),
        targets=lambda wildcards: {
            name: target.model_dump(mode="json")
            for name, target in PLANS[wildcards.dataset].spec.targets.items()
        },
        code=code_digest(
            "store/labels", "store/features", "store/findings", "pipeline/merge"
        ),
    message:
        "Features and labels of {wildcards.dataset}"
    script:
        "../scripts/merge.py"
