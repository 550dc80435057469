# Virtual grippers drawn from what is not known of the paper's: `snakemake draws --config draws=100`.
# Each is a job of its own, so that a sweep goes on where it stopped, also on a cluster.
DRAWN = [*draw_names(config["draws"]), DEFAULT]


rule draws:
    input:
        table=PATHS.draws_table(config["draws"]),
        about=PATHS.draws_about(config["draws"]),
        tables=PATHS.draws_tables(config["draws"]),


rule draw:
    output:
        draw=PATHS.draw(config["draws"], "{draw}"),
        cost=PATHS.draw_cost(config["draws"], "{draw}"),
    log:
        "results/logs/draw/{draw}.log",
    benchmark:
        "results/benchmarks/draw/{draw}.tsv"
    wildcard_constraints:
        draw=rf"draw_\d+|{DEFAULT}",
    conda:
        "../../environment.yml"
    params:
        of=config["draws"],
        recipes=lambda wildcards: sampled_recipes(),
        quick=config["quick"],
        code=lambda wildcards: code_digest(*draw_code()),
    message:
        "Drawing a gripper: {wildcards.draw}"
    script:
        "../scripts/draw.py"


rule join_draws:
    input:
        draws=[PATHS.draw(config["draws"], name) for name in DRAWN],
        costs=[PATHS.draw_cost(config["draws"], name) for name in DRAWN],
    output:
        table=PATHS.draws_table(config["draws"]),
        about=PATHS.draws_about(config["draws"]),
    log:
        "results/logs/draws.log",
    benchmark:
        "results/benchmarks/draws.tsv"
    conda:
        "../../environment.yml"
    params:
        quick=config["quick"],
        code=lambda wildcards: code_digest("ajgdata.pipeline.draws:join_draws"),
    message:
        "Table of all drawn grippers"
    script:
        "../scripts/join_draws.py"


# A sweep takes hours: what it gives is kept in reports/, and the page on it is made of that.
rule draws_tables:
    input:
        table=PATHS.draws_table(config["draws"]),
        about=PATHS.draws_about(config["draws"]),
    output:
        tables=PATHS.draws_tables(config["draws"]),
    log:
        "results/logs/draws_tables.log",
    benchmark:
        "results/benchmarks/draws_tables.tsv"
    conda:
        "../../environment.yml"
    params:
        code=lambda wildcards: code_digest(*tables_code()),
        paper=report_files_digest(PATHS, "paper.yaml"),
    message:
        "Drawn grippers beside the paper"
    script:
        "../scripts/draws_tables.py"
