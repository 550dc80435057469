"""Logs of runs: read from a file, or made up for tests of what shows them."""

import json
from datetime import UTC, datetime, timedelta

CLASSES = ["marker", "padlock", "screw", "strawberry"]
BINS = {"marker": "A", "padlock": "B", "screw": "B", "strawberry": "C"}
START = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


def read_events(path):
    """Every event of a log."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


class Story:
    """Events one after another, each `after` seconds later."""

    def __init__(self):
        self.events = []
        self._now = START
        self._said = 0

    def say(self, event, after=1.0, **about):
        self._now += timedelta(seconds=after)
        time = self._now.isoformat(timespec="milliseconds")
        self.events.append({"n": self._said, "time": time, "event": event, **about})
        self._said += 1
        return self

    def start(self, **about):
        given = {
            "dataset": "ycb",
            "task": "sorting",
            "model": "cnn",
            "classes": CLASSES,
            "threshold": 0.6,
            "bins": BINS,
            "device": "virtual gripper",
            "robot": "manual",
            "session": "sort-01",
            "source": "simulated",
            "novelty": "",
        }
        return self.say("start", **(given | about))

    def hear(self, probability, verdict="known", **take):
        level = {"peak_dbfs": -12.5, "clipped": 0, "xruns": 0, "attempts": 1} | take
        self.say("take", recording="r", seconds=1.0, **level)
        best = max(probability, key=probability.get)
        return self.say(
            "prediction",
            recording="r",
            seconds=0.01,
            kind="classification",
            value=best,
            unit="",
            verdict=verdict,
            novelty=0.4,
            probability=probability,
            interval=None,
            remarks=[],
        )

    def sort(self, number, value, truth="", sure=0.9, placed=True):
        rest = (1 - sure) / (len(CLASSES) - 1)
        probability = {name: sure if name == value else rest for name in CLASSES}
        self.say("grasp", number=number, object=truth).hear(probability)
        self.say("decision", action="place", value=value, bin=BINS[value], reason="")
        if placed:
            self.say("placed", value=value, bin=BINS[value], object=truth)
        return self


def run(sorts=12):
    """Sorts in turn; every fifth is wrong, every third of unknown truth; the last stands open."""
    story = Story().start()
    for number in range(1, sorts + 1):
        truth = CLASSES[number % 4]
        value = CLASSES[(number + 1) % 4] if number % 5 == 0 else truth
        story.sort(number, value, "" if number % 3 == 0 else truth, placed=number < sorts)
    return story.events
