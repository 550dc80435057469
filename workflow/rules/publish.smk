# The target that writes all published data sets.
rule publish:
    input:
        [PATHS.published_sums(name) for name in PUBLISHED],


rule publish_dataset:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
        quarantine=PATHS.quarantine("{dataset}"),
    output:
        # `update` leaves the file in place: a job that fails does not change the published folder.
        sums=update(PATHS.published_sums("{dataset}")),
    log:
        "results/logs/publish/{dataset}.log",
    benchmark:
        "results/benchmarks/publish/{dataset}.tsv"
    params:
        function="publish:publish",
        out=str(PATHS.published("{dataset}")),
        declared=lambda wildcards: settings_digest(SPECS[wildcards.dataset]),
        texts=report_files_digest(PATHS, "templates/card.md.j2"),
        data=own_features,
        code=lambda wildcards: code_hash("publish"),
    message:
        "Publishing {wildcards.dataset}"
    script:
        "../scripts/run.py"


# The sample data in the package, for `make sample`.
rule sample:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
    output:
        sample=PATHS.sample("{dataset}"),
    log:
        "results/logs/sample/{dataset}.log",
    params:
        function="sample:write_sample",
        grasps=2,
        code=lambda wildcards: code_hash("sample"),
        data=own_features,
    message:
        "Writing a sample of {wildcards.dataset}"
    script:
        "../scripts/run.py"
