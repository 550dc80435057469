# One job computes the features of all sessions of a data set. It computes new and changed recordings.
rule features:
    input:
        lambda wildcards: SESSION_FILES[wildcards.dataset],
    output:
        # `update` leaves the files in place: rows of unchanged recordings are used again.
        store=update(PATHS.features("{dataset}")),
        quarantine=update(PATHS.quarantine("{dataset}")),
        hashes=update(PATHS.session_hashes("{dataset}")),
    log:
        "results/logs/features/{dataset}.log",
    benchmark:
        "results/benchmarks/features/{dataset}.tsv"
    threads: feature_processes
    params:
        function="feature_file:build_feature_file",
        sessions=lambda wildcards: list(PLANS[wildcards.dataset].sessions),
        audio=setting("audio"),
        features=setting("features"),
        targets=label_targets,
        tables=session_tables,
        code=lambda wildcards: features_code(SPECS[wildcards.dataset].features),
    message:
        "Features and labels of {wildcards.dataset}"
    script:
        "../scripts/run.py"
