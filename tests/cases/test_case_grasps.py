"""Grasps: empty cells, numbers in several spellings, equal numbers of samples in one grasp."""

from __future__ import annotations

from sounds import resonances, write_wav

NUMBERED = r"(?P<label>\w+)-g(?P<grasp>[\d.]+)-s(?P<sample>\d+)\.wav"


def test_empty_grasp_cells_are_counted(src, ajgdata):
    lines = ["file;label;grasp"]
    for number in range(8):
        write_wav(src / f"r{number}.wav", resonances(0, number))
        grasp = number if number % 4 == 0 else ""
        lines.append(f"r{number};{'cube' if number < 4 else 'ball'};{grasp}")
    (src / "labels.csv").write_text("\n".join(lines) + "\n")
    table = ("--table", "labels.csv", "--file", "{file}.wav", "--target", "label")
    printed = ajgdata("import", src, "--dataset", "d", *table)
    assert printed.code == 3
    assert "6 of 8 rows have no grasp: each of them is a grasp of its own" in printed.text
    printed = ajgdata("import", src, "--dataset", "e", *table, "--grasp", "{label}-{grasp}")
    assert printed.code == 3
    assert "6 of 8 rows have no grasp" in printed.text


def test_one_number_in_several_spellings_is_one_grasp(src, ajgdata, rows):
    for label in ("cube", "ball"):
        for sample, number in enumerate(("1", "01", "1.0"), 1):
            sound = resonances(0, sample + 10 * (label == "cube"))
            write_wav(src / f"{label}-g{number}-s{sample}.wav", sound)
    printed = ajgdata("import", src, "--dataset", "d", "--pattern", NUMBERED)
    assert printed.code == 0, printed.text
    assert "1 number of grasp is spelled in several ways" in printed.text
    assert {row["grasp_id"] for row in rows("d")} == {"cube/1", "ball/1"}


def test_identifiers_stay_different_grasps(src, ajgdata, rows):
    pattern = r"(?P<label>\w+)-(?P<grasp>[^-]+)-(?P<sample>\d)\.wav"
    for number, name in enumerate(("1e3", "1000", "0x1", "1", "A01", "A1")):
        label = "cube" if number < 3 else "ball"
        write_wav(src / f"{label}-{name}-1.wav", resonances(0, number))
    assert ajgdata("import", src, "--dataset", "d", "--pattern", pattern).code == 0
    names = {row["grasp_id"] for row in rows("d")}
    assert names == {"cube/1e3", "cube/1000", "cube/0x1", "ball/1", "ball/A01", "ball/A1"}


def test_a_later_file_joins_the_known_spelling(src, ajgdata, rows):
    write_wav(src / "cube-g01-s1.wav", resonances(0, 1))
    write_wav(src / "ball-g01-s1.wav", resonances(0, 2))
    ajgdata("import", src, "--dataset", "d", "--pattern", NUMBERED)
    assert {row["grasp_id"] for row in rows("d")} == {"cube/01", "ball/01"}
    write_wav(src / "cube-g1-s2.wav", resonances(0, 3))
    printed = ajgdata("import", src, "--dataset", "d")
    assert printed.code == 0, printed.text
    assert {row["grasp_id"] for row in rows("d")} == {"cube/01", "ball/01"}


def test_one_sample_of_a_grasp_twice_is_a_warning(src, ajgdata):
    pattern = r"(?P<label>\w+)-g(?P<grasp>\d+)-s(?P<sample>\d+)[ab]?\.wav"
    for number, name in enumerate(("cube-g1-s1a", "cube-g1-s1b", "ball-g1-s1", "ball-g1-s2")):
        write_wav(src / f"{name}.wav", resonances(0, number))
    printed = ajgdata("import", src, "--dataset", "d", "--pattern", pattern)
    assert printed.code == 3
    assert "cube/1, sample 1 (cube-g1-s1a, cube-g1-s1b)" in printed.text
    assert "warning repeated_sample" in ajgdata("check", "d").text


def test_prune_with_a_narrower_pattern_removes_only_what_is_gone(src, ajgdata, rows):
    for number, name in enumerate(("1_cube", "2_cube", "1_ball", "2_ball")):
        write_wav(src / f"{name}.wav", resonances(0, number))
    ajgdata("import", src, "--dataset", "d")
    (src / "2_cube.wav").unlink()
    narrow = r"(?P<n>\d+)_(?P<label>cube)\.wav"
    printed = ajgdata("import", src, "--dataset", "d", "--pattern", narrow, "--on-change", "prune")
    assert printed.code == 3
    assert "its file is in the folder" in printed.text
    assert {row["recording_id"] for row in rows("d")} == {"1_cube", "1_ball", "2_ball"}


def test_a_numbered_grasp_without_its_label_is_a_warning(src, ajgdata):
    lines = ["file,label,grasp"]
    for number, label in enumerate(("cube", "", "ball", "")):
        write_wav(src / f"r{number}.wav", resonances(0, number))
        lines.append(f"r{number},{label},1")
    (src / "t.csv").write_text("\n".join(lines) + "\n")
    table = ("--table", "t.csv", "--file", "{file}.wav", "--target", "label")
    printed = ajgdata("import", src, "--dataset", "d", *table)
    assert printed.code == 3
    assert "2 of 4 rows have the number of a grasp, but no object or label" in printed.text
