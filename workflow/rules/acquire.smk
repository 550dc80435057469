# Sessions of all recipes.
VIRTUAL = sorted({session for item in PLANS.values() for session in item.virtual})


rule acquire:
    input:
        before=ancient(solved_before),
    output:
        # `update` leaves the files in place: existing recordings are not simulated again.
        session=update(PATHS.session_file("{dataset}", "{session}")),
        recordings=update(PATHS.recordings_file("{dataset}", "{session}")),
        done=touch(PATHS.acquired("{dataset}", "{session}")),
    log:
        "results/logs/acquire/{dataset}.{session}.log",
    benchmark:
        "results/benchmarks/acquire/{dataset}.{session}.tsv"
    wildcard_constraints:
        dataset="|".join(name for name, item in PLANS.items() if item.virtual) or "-",
        session="|".join(VIRTUAL) or "-",
    params:
        function="recipes:acquire_virtual",
        recipe=recipe_of_session,
        code=lambda wildcards: code_hash("acquire"),
    message:
        "Recording session {wildcards.session} of {wildcards.dataset} with the virtual gripper"
    script:
        "../scripts/run.py"
