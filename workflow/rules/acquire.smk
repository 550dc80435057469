VIRTUAL = sorted({session for one in PLANS.values() for session in one.virtual})


rule acquire:
    input:
        scenes=of_session(PATHS.scenes),
        before=ancient(solved_before),
    output:
        audio=PATHS.audio_manifest("{dataset}", "{session}"),
        labels=PATHS.label_manifest("{dataset}", "{session}"),
    log:
        "results/logs/acquire/{dataset}.{session}.log",
    benchmark:
        "results/benchmarks/acquire/{dataset}.{session}.tsv"
    wildcard_constraints:
        dataset="|".join(name for name, one in PLANS.items() if one.virtual) or "-",
        session="|".join(VIRTUAL) or "-",
    conda:
        "../../environment.yml"
    message:
        "Recording session {wildcards.session} of {wildcards.dataset} with the virtual gripper"
    script:
        "../scripts/acquire.py"
