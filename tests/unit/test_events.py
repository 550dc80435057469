"""The log of a live run: written line by line, and read again."""

import json

import numpy as np
import pytest

from ajgdata.live.events import SHOWN_BANDS, EventLog, read_events, shown_spectrum
from ajgdata.types import DataError


def test_what_was_said_is_read_again(tmp_path):
    path = tmp_path / "run" / "events.jsonl"
    heard = []
    with EventLog(path) as log:
        log.listen(heard.append)
        log.say("start", dataset="ycb", classes=["marker", "screw"])
        log.say("stopped", reason="weiß nicht", held="", sorts=0, seconds=1.5)
    assert read_events(path) == heard
    assert [(one["n"], one["event"]) for one in heard] == [(0, "start"), (1, "stopped")]


def test_a_line_that_was_cut_off_is_lost_alone(tmp_path):
    path = tmp_path / "events.jsonl"
    with EventLog(path) as log:
        for number in range(3):
            log.say("grasp", number=number, object="")
    path.write_bytes(path.read_bytes()[:-3])
    assert [one["number"] for one in read_events(path)] == [0, 1]


def test_what_is_no_log_is_refused_and_named(tmp_path):
    path = tmp_path / "events.jsonl"
    good = json.dumps({"n": 0, "time": "2026-01-01T00:00:00.000+00:00", "event": "grasp"})
    for text, where in {
        f"{good}\nbroken\n{good}\n": ":2",
        "[1]\n": ":1",
        good.replace("grasp", "nothing of ours") + "\n": ":1",
        good.replace("+00:00", "") + "\n": ":1",
        "": "no event",
    }.items():
        path.write_text(text)
        with pytest.raises(DataError, match=where):
            read_events(path)
    with pytest.raises(DataError, match="no such file"):
        read_events(tmp_path / "gone.jsonl")


def test_a_drawn_spectrum_is_band_means_over_their_mean():
    feature = np.repeat(np.arange(1.0, SHOWN_BANDS + 1), 16)  # each band holds one value
    expected = np.arange(1, SHOWN_BANDS + 1) / ((SHOWN_BANDS + 1) / 2)
    np.testing.assert_allclose(shown_spectrum(feature), expected, atol=5e-5)  # four decimals
    np.testing.assert_allclose(shown_spectrum(7 * feature), shown_spectrum(feature))
    assert len(shown_spectrum(np.ones(1025))) == SHOWN_BANDS
    assert shown_spectrum(np.zeros(1025)) == [0.0] * SHOWN_BANDS
