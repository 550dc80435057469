"""Defects of the signal: each one has an issue with a fix, and sound recordings have none."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import soundfile
from sounds import RATE_HZ, resonances, write_wav

from ajgdata.pipeline.session_levels import level_issues
from ajgdata.types import Target

OBJECTS = ("cube", "ball")
GRASPS = range(5)


def write_session(src, change=lambda sound, day, number, grasp: sound):
    """Write two days of five grasps of two objects; `change` alters a sound."""
    for day in range(2):
        for number, label in enumerate(OBJECTS):
            for grasp in GRASPS:
                sound = change(resonances(number, grasp, seed=day), day, number, grasp)
                write_wav(src / f"day{day + 1}" / f"{grasp + 1}_{label}.wav", sound)


def checked(ajgdata, src, *options):
    """Import the folder, and return what `check` prints and its exit code."""
    assert ajgdata("import", src, "--dataset", "mine", *options).code in (0, 3)
    return ajgdata("check", "mine", "--all")


def issues(printed, code):
    """Return the recordings with an issue `code`, without their session."""
    lines = [line.split() for line in printed.out.splitlines()]
    names = [words[2].rstrip(":") for words in lines if words[1:2] == [code] and len(words) > 3]
    return [name.partition("/")[2] for name in names]


def test_an_offset_from_the_second_day_on_is_reported_with_its_share(ajgdata, src):
    write_session(src, lambda sound, day, *_: sound + 0.3 * day)
    printed = checked(ajgdata, src)
    assert printed.code == 3
    assert len(issues(printed, "offset")) == 10
    assert all(name.startswith("day2/") for name in issues(printed, "offset"))
    assert "constant offset of 0.3 of full scale" in printed.text
    assert "features.band_hz" in printed.text


def test_a_feature_without_the_lowest_bins_has_no_offset(ajgdata, paths, src):
    write_session(src, lambda sound, day, *_: sound + 0.3 * day)
    assert checked(ajgdata, src).code == 3
    file = paths.dataset("mine")
    file.write_text(f"{file.read_text()}\nfeatures: {{band_hz: [33, 22050]}}\n")
    printed = ajgdata("check", "mine")
    assert issues(printed, "offset") == []
    assert printed.code == 0


def dropout(sound, *_):
    return np.r_[sound[:2000], np.zeros(256), sound[2256:]]


def repeated(sound, *_):
    return np.r_[sound[:2000], sound[1744:2000], sound[2256:]]


def hum(sound, *_):
    time_s = np.arange(len(sound)) / RATE_HZ
    lines = [np.sin(2 * np.pi * 50 * k * time_s + k) / k for k in (1, 2, 3)]
    return sound + 0.05 * np.sum(lines, axis=0)


@pytest.mark.parametrize(
    ("change", "code"), [(dropout, "gap"), (repeated, "repeated_block"), (hum, "hum")]
)
def test_a_defect_of_one_recording_is_reported_for_this_recording(ajgdata, src, change, code):
    def defect(sound, day, number, grasp):
        return change(sound) if (day, number, grasp) == (1, 0, 3) else sound

    write_session(src, defect)
    printed = checked(ajgdata, src)
    assert printed.code == 3
    assert issues(printed, code) == ["day2/4_cube"]
    assert "20 recordings checked: 0 errors, 1 warning, 0 notes" in printed.text


def test_a_feature_without_the_lines_has_no_hum(ajgdata, paths, src):
    write_session(src, hum)
    assert len(issues(checked(ajgdata, src), "hum")) == 20
    file = paths.dataset("mine")
    file.write_text(f"{file.read_text()}\nfeatures: {{band_hz: [500, 20000]}}\n")
    printed = ajgdata("check", "mine")
    assert issues(printed, "hum") == []
    assert printed.code == 0


@pytest.mark.parametrize(("bits", "dtype"), [(16, "<f4"), (32, "<f4"), (24, "<f4"), (16, "<f8")])
def test_float_bytes_under_an_integer_header_are_unusable(ajgdata, src, bits, dtype):
    write_session(src)
    content = resonances(0, 1).astype(dtype).tobytes()
    size = bits // 8
    content = content[: len(content) // size * size]
    head = struct.pack("<IHHIIHH", 16, 1, 1, RATE_HZ, RATE_HZ * size, size, bits)
    body = b"WAVEfmt " + head + b"data" + struct.pack("<I", len(content)) + content
    wrong = src / "day1" / "2_cube.wav"
    wrong.write_bytes(b"RIFF" + struct.pack("<I", len(body)) + body)
    printed = checked(ajgdata, src)
    assert printed.code == 3
    assert issues(printed, "float_bytes") == ["day1/2_cube"]
    assert "1 error" in printed.text


def test_a_gain_that_changes_within_a_session_is_reported_for_each_recording(ajgdata, src):
    write_session(src, lambda sound, day, _, grasp: sound / (10 if day and grasp >= 3 else 1))
    printed = checked(ajgdata, src)
    assert sorted(issues(printed, "level_jump")) == [
        "day2/4_ball",
        "day2/4_cube",
        "day2/5_ball",
        "day2/5_cube",
    ]
    assert "20 dB quieter" in printed.text


LEVELS_DB = np.r_[np.full(50, -20.0), np.full(40, -30.0)]


def jumps_of(rows, targets, levels_db=LEVELS_DB):
    """Return the positions of the recordings with a level jump; `rows` are their labels."""
    deviations = 0.3 * np.random.default_rng(1).normal(size=len(levels_db))
    levels = {str(n): (level,) for n, level in enumerate(levels_db + deviations)}
    table = {str(n): row for n, row in enumerate(rows)}
    reported = level_issues("day1", levels, table, targets, None)
    return [int(issue.recording_id) for issue in reported]


def test_a_class_that_is_quieter_than_the_others_does_not_jump():
    """A full box is quieter than an empty box, and both are one object."""
    rows = [{"object": "box", "fill": fill} for fill in ["empty"] * 50 + ["full"] * 40]
    targets = {"fill": Target(kind="classification")}
    assert jumps_of(rows, targets) == []
    quieter = LEVELS_DB.copy()
    quieter[[3, 70]] -= 12
    assert jumps_of(rows, targets, quieter) == [3, 70]


def test_recordings_without_object_and_class_are_not_compared():
    masses = [{"object": "", "mass_g": "5"}] * 50 + [{"object": "", "mass_g": "900"}] * 40
    assert jumps_of(masses, {"mass_g": Target(kind="regression")}) == []


@pytest.mark.parametrize(
    ("microphone", "names"), [("1", ["4_ball", "5_ball"]), ("2", []), ("mean", [])]
)
def test_the_level_is_that_of_the_microphone_of_the_data_set(ajgdata, src, microphone, names):
    """The loop-back in channel 2 is louder than the microphone, whose gain changes."""
    for number, label in enumerate(OBJECTS):
        for grasp in GRASPS:
            sound = 0.1 * resonances(number, grasp)
            gain = 0.1 if (label == "ball" and grasp >= 3) else 1
            loop_back = 5 * sound
            path = src / f"{grasp + 1}_{label}.wav"
            write_wav(path, np.stack([gain * sound, loop_back], axis=1))
    printed = checked(ajgdata, src, "--microphone", microphone)
    assert sorted(issues(printed, "level_jump")) == names


def test_channels_that_are_swapped_in_some_recordings_are_reported(ajgdata, src):
    for number, label in enumerate(OBJECTS):
        for grasp in GRASPS:
            sound = resonances(number, grasp)
            columns = [sound, 0.2 * np.roll(sound, 20)]
            if grasp == 2:
                columns.reverse()
            path = src / f"{grasp + 1}_{label}.wav"
            soundfile.write(path, np.stack(columns, axis=1), RATE_HZ, subtype="PCM_16")
    printed = checked(ajgdata, src, "--microphone", "1")
    assert sorted(issues(printed, "channels_swapped")) == ["3_ball", "3_cube"]


def test_sound_with_quiet_ends_and_digital_silence_around_it_has_no_issue(ajgdata, src):
    def fade(sound, *_):
        silence = np.zeros(1000)
        return np.r_[silence, sound * np.linspace(1, 0, len(sound)) ** 4, silence]

    write_session(src, fade)
    printed = checked(ajgdata, src)
    assert printed.code == 0
    assert "20 recordings checked: 0 errors, 0 warnings, 0 notes" in printed.text
