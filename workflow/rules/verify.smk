# The solver is checked where it made recordings.
WITHOUT_SOLVER = config["quick"] or not VIRTUAL


rule verify:
    input:
        runs=PATHS.runs,
        tests=HERE / "tests/artefacts/test_results.py",
    output:
        summary=PATHS.verified,
    log:
        str(PATHS.log("verify")),
    conda:
        "../../environment.yml"
    params:
        quick=WITHOUT_SOLVER,
        run=PATHS.run,
        code=code_of(
            "ajgdata.pipeline.verify:verify",
            *([] if WITHOUT_SOLVER else ["ajgdata.gripper"]),
        ),
    message:
        "Checking the results"
        + (
            ""
            if WITHOUT_SOLVER
            else ", and the solver on runs too long for the test suite"
        )
    script:
        "../scripts/verify.py"


# Last of all: fails, when everything else is there, if something that was asked for was skipped.
rule complete:
    input:
        EVERYTHING,
    output:
        summary=PATHS.complete,
    log:
        str(PATHS.log("complete")),
    conda:
        "../../environment.yml"
    params:
        datasets=list(PLANS),
        documents=documents_of(MEASURED),
        run=PATHS.run,
        optional=[key for key in ASKED if ASKED[key].optional_in(SPECS[key[0]])],
        code=code_of("ajgdata.pipeline.run_summary:complete"),
    message:
        "Was everything made that was asked for?"
    script:
        "../scripts/complete.py"
