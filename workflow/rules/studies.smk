# Studies of the virtual gripper, which need no data set.
wildcard_constraints:
    study="|".join(STUDIES),


rule study:
    output:
        tables=PATHS.study("{study}"),
    log:
        "results/logs/study/{study}.log",
    benchmark:
        "results/benchmarks/study/{study}.tsv"
    params:
        function="studies:run_study",
        quick=config["quick"],
        code=lambda wildcards: code_hash("study"),
    message:
        "Studying the virtual gripper: {wildcards.study}"
    script:
        "../scripts/run.py"


# The opening picture of the report: a simulated grasp and its prediction.
if OPENING:

    rule opening:
        input:
            store=PATHS.features(OPENING),
            hashes=PATHS.session_hashes(OPENING),
            tables=PATHS.experiment(OPENING, OBJECT, *SHOWN_RESULT),
        output:
            folder=directory(PATHS.opening.parent),
        log:
            "results/logs/opening.log",
        benchmark:
            "results/benchmarks/opening.tsv"
        params:
            function="opening:build_opening",
            audio=SPECS[OPENING].audio.model_dump(mode="json"),
            data=lambda wildcards: features_of(OPENING),
            code=lambda wildcards: code_hash("opening"),
        message:
            "The gripper in pictures"
        script:
            "../scripts/run.py"
