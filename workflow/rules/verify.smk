rule verify:
    input:
        runs=PATHS.runs,
        tests=HERE / "tests/artefacts/test_results.py",
    output:
        summary=PATHS.results / "verify" / "summary.txt",
    log:
        "results/logs/verify.log",
    conda:
        "../../environment.yml"
    params:
        quick=config["quick"],
        code=code_of("ajgdata.pipeline.verify:verify", "ajgdata.gripper"),
    message:
        "Checking the results, and the solver on runs too long for the test suite"
    script:
        "../scripts/verify.py"
