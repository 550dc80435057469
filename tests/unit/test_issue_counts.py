"""Each recording counts once, by its worst issue."""

from ajgdata.types import Finding, IssueCounts, issue_counts


def issue(name, level, session="s"):
    return Finding(session, name, "", level, "code", "problem", "fix")


def test_the_worst_issue_of_a_recording_counts():
    issues = [
        issue("a", "note"),
        issue("a", "error"),
        issue("a", "warning"),
        issue("b", "note"),
        issue("b", "warning"),
        issue("b", "note", session="t"),
        issue("*", "error"),
    ]
    assert issue_counts(issues) == IssueCounts(errors=1, warnings=1, notes=1)
    assert str(issue_counts(issues)) == "1 error, 1 warning, 1 note"


def test_no_issues_are_false_and_counts_add():
    assert not issue_counts([issue("*", "error")])
    total = IssueCounts(errors=1) + IssueCounts(warnings=1200, notes=2)
    assert str(total) == "1 error, 1,200 warnings, 2 notes"
