VIRTUAL = sorted({session for one in PLANS.values() for session in one.virtual})


rule acquire:
    message:
        "Recording session {wildcards.session} of {wildcards.dataset} with the virtual gripper"
    input:
        scenes=PATHS.scenes("{dataset}", "{session}"),
    output:
        audio=PATHS.audio_manifest("{dataset}", "{session}"),
        labels=PATHS.label_manifest("{dataset}", "{session}"),
    wildcard_constraints:
        dataset="|".join(name for name, one in PLANS.items() if one.virtual) or "-",
        session="|".join(VIRTUAL) or "-",
    params:
        root=str(PATHS.root),
    log:
        "results/logs/acquire/{dataset}.{session}.log",
    benchmark:
        "results/benchmarks/acquire/{dataset}.{session}.tsv"
    conda:
        "../../environment.yml"
    script:
        "../scripts/acquire.py"
