"""Sessions: two values or two folders never become one session."""

from __future__ import annotations

import pytest
from sounds import resonances, write_wav

from ajgdata.store.session_names import stored_session_names
from ajgdata.store.sessions import list_sessions

VALUES = [
    ("-5", "5", "20", "+5"),
    ("実験一", "実験二", "опыт"),
    ("day 1", "day_1", "Day_1"),
    ("a/b", "a_b", "a b"),
    ("Tür", "T_r", "Tor"),
]


@pytest.mark.parametrize("values", VALUES)
def test_different_values_have_different_names(values):
    names = stored_session_names(values)
    assert len({name.casefold() for name in names.values()}) == len(values)
    assert names == stored_session_names(tuple(reversed(values)))


def test_signed_sessions_of_a_table(src, ajgdata, paths):
    lines = ["name,label,temperature"]
    for number, temperature in enumerate(("-5", "5", "-5", "5")):
        write_wav(src / f"{number}.wav", resonances(0, number))
        lines.append(f"{number},{'cube' if number < 2 else 'ball'},{temperature}")
    (src / "t.csv").write_text("\n".join(lines) + "\n")
    printed = ajgdata(
        *("import", src, "--dataset", "d", "--table", "t.csv", "--file", "{name}.wav"),
        *("--target", "label", "--session", "{temperature}"),
    )
    assert printed.code == 0, printed.text
    assert sorted(list_sessions(paths, "d")) == ["5", "minus5"]
    assert "session '-5': is stored as minus5" in printed.text


@pytest.mark.parametrize("is_same_names", [True, False])
def test_two_days_in_folders_of_one_name_are_refused(tmp_path, ajgdata, rows, is_same_names):
    for day, first in (("monday", 1), ("tuesday", 1 if is_same_names else 5)):
        for number in range(first, first + 3 + (day == "tuesday")):
            for label in ("cube", "ball"):
                file = tmp_path / day / "recordings" / f"{number}_{label}.wav"
                seed = len(day) + 99 * (label == "cube")
                write_wav(file, resonances(0, number, seed=seed))
    assert ajgdata("import", tmp_path / "monday" / "recordings", "--dataset", "d").code == 0
    before = rows("d", "recordings")
    tuesday = tmp_path / "tuesday" / "recordings"
    printed = ajgdata("import", tuesday, "--dataset", "d")
    assert printed.code == 1
    assert "session 'recordings' has 6 recordings from another folder" in printed.text
    assert "--session" in printed.text
    assert "prune" not in printed.text
    assert rows("d", "recordings") == before
    assert ajgdata("import", tuesday, "--dataset", "d", "--session", "tuesday").code == 0
    assert len(rows("d", "tuesday")) == 8
