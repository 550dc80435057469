rule verify:
    message:
        "Checking the results, and the solver on runs too long for the test suite"
    input:
        report=PATHS.report,
        tests=HERE / "tests/artefacts",
    output:
        PATHS.results / "verify" / "summary.txt",
    params:
        tests=str(HERE / "tests"),
        code=code_digest("gripper"),
    log:
        "results/logs/verify.log",
    conda:
        "../../environment.yml"
    script:
        "../scripts/verify.py"
