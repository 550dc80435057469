"""The log of a live run."""

import numpy as np
import pytest
from live_events import read_events

from ajgdata.live.events import SHOWN_BANDS, EventLog, shown_spectrum


def test_events_are_written_line_by_line_and_passed_to_listeners(tmp_path):
    path = tmp_path / "run" / "events.jsonl"
    passed = []
    with EventLog(path) as log:
        log.listen(passed.append)
        log.say("start", dataset="ycb", classes=["marker", "screw"])
        assert read_events(path) == passed
        log.say("stopped", reason="weiß nicht", held="", sorts=0, seconds=1.5)
        with pytest.raises(ValueError, match="JSON compliant"):
            log.say("drift", ratio=float("nan"))
    assert read_events(path) == passed
    assert [(one["n"], one["event"]) for one in passed] == [(0, "start"), (1, "stopped")]


def test_a_drawn_spectrum_is_band_means_over_their_mean():
    feature = np.repeat(np.arange(1.0, SHOWN_BANDS + 1), 16)  # each band holds one value
    expected = np.arange(1, SHOWN_BANDS + 1) / ((SHOWN_BANDS + 1) / 2)
    np.testing.assert_allclose(shown_spectrum(feature), expected, atol=5e-5)  # four decimals
    np.testing.assert_allclose(shown_spectrum(7 * feature), shown_spectrum(feature))
    assert len(shown_spectrum(np.ones(1025))) == SHOWN_BANDS
    assert shown_spectrum(np.zeros(1025)) == [0.0] * SHOWN_BANDS
