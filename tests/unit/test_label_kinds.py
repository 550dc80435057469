"""Is a column of labels a number or a class, and which cells are missing?"""

import pytest

from ajgdata.pipeline.importing import infer_target

NUMBERS = [str(100.5 + n) for n in range(14)]


@pytest.mark.parametrize(
    ("cells", "kind", "missing", "said"),
    [
        (NUMBERS, "regression", (), "a number (14 distinct numbers, 100.5 to 113.5)"),
        (
            [*NUMBERS, "n/a", "NaN"],
            "regression",
            ("NaN", "n/a"),
            "declared missing: 'NaN', 'n/a'",
        ),
        ([*NUMBERS, "inf"], "regression", (), "a number (14 distinct"),
        (["1", "2", "3"] * 9, "classification", (), "a class (3 distinct texts)"),
        (
            [*NUMBERS, *"abcdefgh"],
            "classification",
            (),
            "a class (22 distinct texts)",
        ),
        (["cube", "ball", "NaN"], "classification", ("NaN",), "declared missing: 'NaN'"),
    ],
)
def test_kinds(cells, kind, missing, said):
    target, why = infer_target(cells)
    assert (target.kind, target.missing) == (kind, missing)
    assert said in why
