wildcard_constraints:
    study="|".join(STUDIES) or "-",


rule study:
    output:
        figures=PATHS.study("{study}"),
    log:
        "results/logs/study/{study}.log",
    benchmark:
        "results/benchmarks/study/{study}.tsv"
    conda:
        "../../environment.yml"
    threads: lambda wildcards: workflow.cores if wildcards.study in TIMED else 1
    params:
        quick=config["quick"],
        code=lambda wildcards: code_digest(*study_code(wildcards.study)),
    message:
        "Studying the virtual gripper: {wildcards.study}"
    script:
        "../scripts/study.py"


rule study_page:
    input:
        figures=PATHS.study("{study}"),
    output:
        page=PATHS.page("{study}"),
        figures=directory(PATHS.page_figures("{study}")),
    log:
        "results/logs/study_page/{study}.log",
    benchmark:
        "results/benchmarks/study_page/{study}.tsv"
    conda:
        "../../environment.yml"
    params:
        pages=PAGES,
        texts=REPORT_FILES,
        code=code_of("ajgdata.pipeline.pages:build_study_page"),
    message:
        "Page on {wildcards.study}"
    script:
        "../scripts/study_page.py"


rule gallery:
    output:
        page=PATHS.page(GALLERY),
        figures=directory(PATHS.page_figures(GALLERY)),
    log:
        "results/logs/gallery.log",
    benchmark:
        "results/benchmarks/gallery.tsv"
    conda:
        "../../environment.yml"
    params:
        pages=PAGES,
        quick=config["quick"],
        texts=REPORT_FILES,
        code=code_of(GALLERY_CODE),
    message:
        "Gallery of objects and grippers"
    script:
        "../scripts/gallery.py"
