"""The control of all cases: sounds that are imported correctly have no issue."""

from sounds import resonances, write_wav


def test_distinct_recordings_in_files_of_the_starter_kit_have_no_issue(ajgdata, src, rows):
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, 4):
            write_wav(src / f"{grasp + 3 * number}_{label}.wav", resonances(number, grasp))
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    assert [row["label"] for row in rows("mine")].count("cube") == 3
    checked = ajgdata("check", "mine")
    assert checked.code == 0
    assert "6 recordings checked: 0 errors, 0 warnings" in checked.text
