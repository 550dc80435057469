rule evaluate:
    message:
        "Cross-validating {wildcards.model} on {wildcards.task} of {wildcards.dataset}"
    input:
        store=PATHS.features("{dataset}"),
    output:
        metrics=PATHS.metrics("{dataset}", "{task}", "{model}"),
        cost=PATHS.cost("{dataset}", "{task}", "{model}"),
        predictions=PATHS.predictions("{dataset}", "{task}", "{model}"),
    params:
        task=lambda wildcards: PLANS[wildcards.dataset].spec.evaluation(wildcards.task),
        seed=config["seed"],
        code=code_digest("models", "evaluate", "pipeline/evaluate"),
    log:
        "results/logs/evaluate/{dataset}.{task}.{model}.log",
    benchmark:
        "results/benchmarks/evaluate/{dataset}.{task}.{model}.tsv"
    conda:
        "../../environment.yml"
    script:
        "../scripts/evaluate.py"
