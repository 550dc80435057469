rule curve:
    input:
        store=PATHS.merged("{dataset}"),
    output:
        document=PATHS.curve("{dataset}", "{task}", "{model}"),
    log:
        "results/logs/curve/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/curve/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="curve_task",
        task=lambda wildcards: PLANS[wildcards.dataset].spec.experiment(wildcards.task),
        more=lambda wildcards: {
            "sizes": declared(wildcards).curve.groups,
            "repeats": declared(wildcards).curve.repeats,
            "seed": config["seed"],
        },
        code=code_of("ajgdata.pipeline.rows:curve_task"),
    message:
        "Learning curve of {wildcards.model} on {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/rows.py"


rule permute:
    input:
        store=PATHS.merged("{dataset}"),
    output:
        document=PATHS.permutations("{dataset}", "{task}"),
    log:
        "results/logs/permute/{dataset}.{task}.log",
    benchmark:
        "results/benchmarks/permute/{dataset}.{task}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="permute_task",
        task=lambda wildcards: PLANS[wildcards.dataset].spec.experiment(wildcards.task),
        more=lambda wildcards: {
            "permutations": declared(wildcards).permutations,
            "seed": config["seed"],
        },
        code=code_of("ajgdata.pipeline.rows:permute_task"),
    message:
        "Testing {wildcards.task} of {wildcards.dataset} against chance"
    script:
        "../scripts/rows.py"


rule sort:
    input:
        store=PATHS.merged("{dataset}"),
    output:
        document=PATHS.sorting("{dataset}", "{task}", "{model}"),
    log:
        "results/logs/sort/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/sort/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="sort_task",
        task=lambda wildcards: PLANS[wildcards.dataset].spec.experiment(wildcards.task),
        more=lambda wildcards: {
            **declared(wildcards).sorting.model_dump(include={"objects", "threshold"}),
            "seed": config["seed"],
        },
        code=code_of("ajgdata.pipeline.rows:sort_task"),
    message:
        "Sorting by {wildcards.model} on {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/rows.py"


rule calibrate:
    input:
        store=PATHS.merged("{dataset}"),
        others=lambda wildcards: [
            PATHS.merged(other) for other in declared(wildcards).calibrate.test_on
        ],
    output:
        document=PATHS.transfer("{dataset}", "{task}", "{model}"),
    log:
        "results/logs/calibrate/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/calibrate/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    params:
        task=lambda wildcards: PLANS[wildcards.dataset].spec.experiment(wildcards.task),
        on=lambda wildcards: declared(wildcards).calibrate.test_on,
        grasps=lambda wildcards: declared(wildcards).calibrate.grasps,
        seed=config["seed"],
        code=code_of("ajgdata.pipeline.rows:calibrate_task"),
    message:
        "{wildcards.model} of {wildcards.task} of {wildcards.dataset} on other grippers"
    script:
        "../scripts/calibrate.py"


rule energy:
    input:
        store=PATHS.merged("{dataset}"),
    output:
        document=PATHS.energies("{dataset}", "{task}"),
    log:
        "results/logs/energy/{dataset}.{task}.log",
    benchmark:
        "results/benchmarks/energy/{dataset}.{task}.tsv"
    conda:
        "../../environment.yml"
    params:
        call="energy_task",
        task=lambda wildcards: PLANS[wildcards.dataset].spec.labelled(wildcards.task),
        more=lambda wildcards: declared(wildcards).energy.model_dump(mode="json"),
        code=code_of("ajgdata.pipeline.rows:energy_task"),
    message:
        "Energies of {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/rows.py"


rule collect:
    input:
        metrics=of_runs(PATHS.metrics, TASKS),
        costs=of_runs(PATHS.cost, TASKS),
        documents=of_experiments(TASKS),
        embeddings=of_embeddings(EMBEDDINGS),
    output:
        document=PATHS.all_metrics,
        table=PATHS.metrics_table,
    log:
        "results/logs/collect.log",
    benchmark:
        "results/benchmarks/collect.tsv"
    conda:
        "../../environment.yml"
    params:
        root=str(PATHS.root),
        tasks=TASKS,
        embeddings=EMBEDDINGS,
        code=code_of("ajgdata.pipeline.collect:collect"),
    message:
        "All results in one table"
    script:
        "../scripts/collect.py"
