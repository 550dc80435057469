# Measures one job of an experiment on a task or an embedding.
rule experiment:
    input:
        store=PATHS.features("{dataset}"),
        hashes=PATHS.session_hashes("{dataset}"),
        other_sets=lambda wildcards: [
            PATHS.features(other) for other in requested(wildcards).required_sets
        ],
        other_hashes=lambda wildcards: [
            PATHS.session_hashes(other) for other in requested(wildcards).required_sets
        ],
        encoders=encoder_files,
    output:
        tables=PATHS.experiment("{dataset}", "{task}", "{experiment}", "{models}"),
        cost=PATHS.experiment_cost("{dataset}", "{task}", "{experiment}", "{models}"),
    log:
        "results/logs/experiment/{dataset}/{task}/{experiment}.{models}.log",
    benchmark:
        "results/benchmarks/experiment/{dataset}/{task}/{experiment}.{models}.tsv"
    # Simulations and networks take longest. If they started last, the run would wait for them.
    priority:
        lambda wildcards: int(
            requested(wildcards).experiment.renders or "cnn" in wildcards.models
        )
    params:
        function="experiments:run_experiment",
        parts=lambda wildcards: requested(wildcards).part_names,
        settings=lambda wildcards: requested(wildcards).job_settings(),
        task_settings=task_settings,
        other_tasks=other_tasks,
        other_sets=lambda wildcards: list(requested(wildcards).other_sets),
        audio=setting("audio"),
        features=setting("features"),
        rendered=rendered_from,
        seed=config["seed"],
        device=config["device"],
        # These two only decide whether the job is outdated.
        data=lambda wildcards: features_of(
            wildcards.dataset, *requested(wildcards).required_sets
        ),
        code=experiment_code,
    message:
        "Measuring {wildcards.experiment} ({wildcards.models}) of {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/run.py"
