"""Names of recorders and collections that only look like `<n>_<label>` are not imported as such."""

import datetime

import pytest
from sounds import resonances, write_wav

from ajgdata.store.sessions import list_datasets
from ajgdata.store.starter_kit import starter_kit_objection

START = datetime.datetime(2026, 3, 29, 1, 30)
TIMES = [START + datetime.timedelta(minutes=10 * i) for i in range(14)]
HEX = ("0a7c2a8d", "00176480", "0ac15fe9", "1b4c9b89", "2d82a556", "c50f55b8", "f59d771b")
CLOCK = "the numbers are dates or times"
TRACKS = ("Intro", "Sea", "Sky", "Rain", "Wind", "End")
#: Names by recorder, and the reason in the message.
LOOK_ALIKES = {
    "AudioMoth": ([f"{t:%Y%m%d_%H%M%S}.WAV" for t in TIMES], CLOCK),
    "AudioMoth with a trigger": ([f"{t:%Y%m%d_%H%M%S}T.WAV" for t in TIMES], CLOCK),
    "AudioMoth at one time of several days": (
        [f"202603{day}_{hour}0000.WAV" for day in range(10, 20) for hour in ("06", "18")],
        CLOCK,
    ),
    "Zoom": ([f"26110{1 + i // 4}_{i % 4 + 1:03d}.WAV" for i in range(8)], CLOCK),
    "Zoom, tracks": ([f"240115_{i:03d}_Tr{t}.WAV" for i in (1, 2, 3) for t in (1, 2)], CLOCK),
    "telephone": (["20230101_120000.m4a", "20230101_120500.m4a"], CLOCK),
    "telephone, one file": (["20230101_120000.m4a"], CLOCK),
    "European date": ([f"150120{y}_cube.wav" for y in (24, 25)], CLOCK),
    "date with separators": ([f"2026_03_{day}_cube.wav" for day in (28, 29)], CLOCK),
    "Unix time": ([f"17000000{i:02d}_{i % 3}.wav" for i in range(12)], CLOCK),
    "two counters": ([f"0001_{i:04d}.wav" for i in range(1, 21)], "labels are digits that rarely"),
    "a few integers": (["1_10.wav", "2_20.wav", "3_30.wav"], "labels are digits that rarely"),
    "Freesound": (
        [f"{180000 + 977 * i}__maker{i % 3}__{('wood', 'metal')[i % 2]} hit.wav" for i in range(8)],
        "file names are not <n>_<label>.wav",
    ),
    "tracks of an album": (
        [f"{i:02d}_{name}.flac" for i, name in enumerate(TRACKS, 1)],
        "most of 6 labels occur once, e.g. 'End'",
    ),
    "spoken digits": (
        [f"{digit}_jackson_{i}.wav" for digit in range(10) for i in range(4)],
        "'jackson_0' has number 0, which is the played sound, and other numbers",
    ),
    "numbers from 0": (
        ["0_cube.wav", "1_cube.wav", "2_ball.wav", "3_ball.wav"],
        "'cube' has number",
    ),
    "Speech Commands": (
        [f"{word}/{name}_nohash_0.wav" for word in ("bed", "cat") for name in HEX],
        "only 2 of 14 file names are <n>_<label>.wav",
    ),
    "ESC-50": ([f"1-1000{i}-A-{i % 2}.wav" for i in range(10)], "are not <n>_<label>.wav"),
    "voice recorder": ([f"Recording_{i}.wav" for i in range(9)], "are not <n>_<label>.wav"),
    "Zoom H1": ([f"ZOOM{i:04d}.WAV" for i in range(9)], "are not <n>_<label>.wav"),
}
GENUINE = {
    "repeated labels": ["1_cube.wav", "2_ball.wav", "3_cube.wav", "4_ball.wav", "0_sweep.wav"],
    "a first trial": ["1_cube.wav", "2_ball.wav", "3_bar.wav"],
    "one recording": ["1_cube.wav"],
    "one label": ["1_metal.wav", "2_metal.wav"],
    "positions in cm, all different": [f"{i}_{i * 0.25}.wav" for i in range(1, 20)],
    "positions and none": ["17_7.5.wav", "18_8.wav", "19_8.5.wav", "20_3.wav", "100_none.wav"],
    "angles with signs": [f"{i}_{10 * (i - 4):+d}.wav" for i in range(1, 8)],
    "positions in mm": [f"{5 * p + r}_{10 * p}.wav" for p in range(9) for r in range(1, 6)],
    "positions in mm, numbers per label": [f"{r}_{10 * p}.wav" for p in range(9) for r in (1, 2)],
    "points and recordings": [
        f"data/{100 * point + recording}_{('contact', 'no_contact')[point % 2]}.wav"
        for point in range(1, 133)
        for recording in range(1, 6)
    ],
    "numbers begin again per label": [
        f"{i}_{label}.wav" for i in range(1, 9) for label in ("contact", "no_contact")
    ],
    "sessions": [
        f"day{day}/{i}_{label}.wav"
        for day in (1, 2)
        for i, label in enumerate(["sweep", "a", "b", "c", "d"])
    ],
    "many objects, few repeats": [f"{i}_object {i // 2}.wav" for i in range(1, 41)],
    "more than 100,000 recordings": [f"{i}_{'ab'[i % 2]}.wav" for i in range(109_000, 112_000, 3)],
    "some other files": [*(f"{i}_cube.wav" for i in range(1, 4)), "long take.wav"],
}


def write(src, names):
    for number, name in enumerate(names):
        write_wav(src / name, resonances(number % 2, number, frames=2_000))


@pytest.mark.parametrize("recorder", LOOK_ALIKES)
def test_look_alikes_are_not_of_the_starter_kit(tmp_path, recorder):
    names, reason = LOOK_ALIKES[recorder]
    assert reason in starter_kit_objection(
        [tmp_path.joinpath(n).relative_to(tmp_path) for n in names]
    )


@pytest.mark.parametrize("name", GENUINE)
def test_genuine_names_are_of_the_starter_kit(tmp_path, name):
    files = [tmp_path.joinpath(file).relative_to(tmp_path) for file in GENUINE[name]]
    assert starter_kit_objection(files) == ""


@pytest.mark.parametrize("recorder", ["AudioMoth", "Zoom", "Freesound", "Speech Commands"])
def test_the_import_prints_the_fields_and_writes_nothing(ajgdata, paths, src, recorder):
    names, reason = LOOK_ALIKES[recorder]
    write(src, [name for name in names if not name.endswith(".m4a")])
    printed = ajgdata("import", src, "--dataset", "mine")
    assert printed.code == 1
    assert reason in printed.err
    assert "--pattern starter-kit reads <n>_<label>.wav unchecked" in printed.err
    assert printed.err.count("\n") == 1
    assert "file names have this form (fields from left to right)" in printed.out
    assert "  --pattern '" in printed.out
    assert list_datasets(paths) == []


def test_the_option_forces_the_starter_kit(ajgdata, src, rows):
    write(src, [f"{i:02d}_{name}.wav" for i, name in enumerate("ABCDEF", 1)])
    assert ajgdata("import", src, "--dataset", "mine").code == 1
    assert ajgdata("import", src, "--dataset", "mine", "--pattern", "starter-kit").code == 0
    assert [row["label"] for row in rows("mine")] == list("ABCDEF")
    write(src, ["07_G.wav"])
    again = ajgdata("import", src, "--dataset", "mine")
    assert again.code == 0
    assert "1 added" in again.out


def test_genuine_folders_are_imported_with_the_values_of_their_names(ajgdata, src, rows):
    write(src, ["a/0_sweep.wav", *(f"a/{name}" for name in GENUINE["positions and none"])])
    printed = ajgdata("import", src, "--dataset", "mine")
    assert printed.code == 0
    assert "a/0_sweep.wav: the played sound" in printed.text
    assert {row["n"]: row["label"] for row in rows("mine", "a")} == {
        **{"17": "7.5", "18": "8", "19": "8.5", "20": "3", "100": "none"}
    }
