"""What readers of a run get: the latest state, whoever is slow."""

import json
import threading
import time

from live_events import Story, run

from ajgdata.live.control import Control, Mode
from ajgdata.live.feed import Feed
from ajgdata.live.run_state import folded


def told(events, control=None):
    feed = Feed(control or Control())
    for event in events:
        feed.tell(event)
    return feed


def test_a_reader_who_comes_late_sees_the_same():
    events = run()
    early, late = told(events[:1]), told(events)
    first = early.shown()
    for event in events[1:]:
        early.tell(event)
    assert early.shown().text == late.shown().text
    assert early.shown().version > first.version
    expected = json.loads(json.dumps(folded(events).plain()))
    expected |= {"mode": "running", "correctable": False, "unshown": 0}
    assert json.loads(late.shown().text) == expected


def test_waiting_ends_with_the_next_event_or_with_time():
    feed = told(run()[:1])
    seen = feed.shown().version
    assert not feed.wait(seen, 0.01)
    threading.Timer(0.05, feed.tell, [run()[1]]).start()
    began = time.monotonic()
    assert feed.wait(seen, 30)
    assert time.monotonic() - began < 15
    assert feed.shown().version == seen + 1


def test_a_mode_that_changes_without_an_event_is_news():
    control = Control(Mode.WAITING)
    feed = told(run()[:1], control)
    seen = feed.shown()
    assert json.loads(seen.text)["mode"] == "waiting"
    control.start()
    assert feed.wait(seen.version, 0)
    assert json.loads(feed.shown().text)["mode"] == "running"


def test_a_run_that_says_it_stopped_is_stopped_whatever_its_control_says():
    story = Story().start().say("stopped", reason="done", held="", sorts=0, seconds=1.0)
    assert json.loads(told(story.events).shown().text)["mode"] == "stopped"


def test_an_event_that_cannot_be_shown_harms_nobody():
    no_number = {"n": 98, "time": "", "event": "grasp"}
    no_json = {"n": 99, "time": run()[-1]["time"], "event": "reference", "drift": float("nan")}
    feed = told([*run(), no_number, no_json])
    found = json.loads(feed.shown().text)
    assert (found["unshown"], found["n"]) == (2, len(run()) - 1)


def test_a_closed_feed_lets_all_go():
    feed = told(run())
    seen = feed.shown().version
    waiting = threading.Thread(target=feed.wait, args=(seen, 60))
    waiting.start()
    feed.close()
    waiting.join(10)
    assert not waiting.is_alive() and feed.closed
