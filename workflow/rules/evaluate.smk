rule evaluate:
    input:
        store=PATHS.merged("{dataset}"),
        others=lambda wildcards: [
            PATHS.merged(other)
            for other in PLANS[wildcards.dataset].spec.tasks[wildcards.task].test_on
        ],
    output:
        metrics=PATHS.metrics("{dataset}", "{task}", "{model}"),
        cost=PATHS.cost("{dataset}", "{task}", "{model}"),
        predictions=PATHS.predictions("{dataset}", "{task}", "{model}"),
    log:
        "results/logs/evaluate/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/evaluate/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    params:
        task=lambda wildcards: PLANS[wildcards.dataset].spec.evaluation(wildcards.task),
        seed=config["seed"],
        code=code_digest("models", "evaluate", "pipeline/evaluate"),
    message:
        "Cross-validating {wildcards.model} on {wildcards.task} of {wildcards.dataset}"
    script:
        "../scripts/evaluate.py"
