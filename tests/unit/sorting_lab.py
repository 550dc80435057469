"""A sorting cell in this process: a fake card, a robot that writes down its steps, a model whose
predictions are known beforehand."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path

import numpy as np
from fake_card import RATE_HZ, FakeLine, fake_card
from live_events import read_events

from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.excitation import excitation_samples
from ajgdata.acquire.live_session import live_session
from ajgdata.acquire.robot import RobotError, RobotGrasp
from ajgdata.live.events import EventLog
from ajgdata.live.predictor import NoveltyVerdict, Prediction
from ajgdata.live.sort import Sorter
from ajgdata.live.steps import Control
from ajgdata.types import DatasetSpec, LogSweep, PassiveRecording
from ajgdata.types.protocol import SortPlan

CLASSES = ("ball", "cube", "rod")
BINS = {"ball": "A", "cube": "B", "rod": "C"}
PLAN = {
    "dataset": "d",
    "task": "t",
    "bins": BINS,
    "wait_s": 0,
    "references": None,
    "card": {"device": "fake"},
}
SWEEP = LogSweep(length_s=0.1)


def plan(**changes) -> SortPlan:
    return SortPlan.model_validate(PLAN | changes)


def seen(*shares, verdict="known", novelty=0.5) -> Prediction:
    """A prediction with probabilities of CLASSES."""
    probability = dict(zip(CLASSES, shares, strict=True))
    best = max(probability, key=probability.__getitem__)
    return Prediction("classification", best, "", NoveltyVerdict(verdict), novelty, probability)


BALL = seen(0.9, 0.05, 0.05)
CUBE = seen(0.1, 0.8, 0.1)
ROD = seen(0.02, 0.03, 0.95)
UNSURE = seen(0.5, 0.3, 0.2)
EMPTY = seen(0.9, 0.05, 0.05, verdict="nothing")
STRANGE = seen(0.9, 0.05, 0.05, verdict="unknown", novelty=2.5)


class Scripted:
    """Predictions one after another; the last one for ever."""

    classes = CLASSES
    novelty_note = "the novelty check detects only 30 % of novel objects"

    def __init__(self, *predictions: Prediction) -> None:
        self.predictions = list(predictions)
        self.references = []
        self.received = []

    def predict(self, waveform, sample_rate_hz, played=None):
        assert sample_rate_hz == RATE_HZ
        self.received.append(waveform)
        return self.predictions.pop(0) if len(self.predictions) > 1 else self.predictions[0]

    @property
    def has_references(self):
        return bool(self.references)

    def feature(self, waveform, sample_rate_hz, played=None):
        return np.abs(np.fft.rfft(waveform[:256])).astype(np.float32)

    def with_references(self, features):
        self.references.append(features)
        return self


class Robot:
    """Writes down each step; `at` maps the number of a step (from 0) to what then happens."""

    def __init__(self, at=None) -> None:
        self.steps = []
        self.at = dict(at or {})

    def move(self, step, **about):
        number = len(self.steps)
        details = [RobotGrasp(**about)] if step == "approach" else about.values()
        self.steps.append((step, *details))
        if number in self.at:
            self.at[number]()
        return {"force_n": 7.5, "x_m": 0.31} if step == "approach" else {}

    @property
    def names(self) -> list[str]:
        return [step for step, *_ in self.steps]


def fails() -> None:
    raise RobotError("robot", "stuck", "look at it")


def interrupts() -> None:
    raise KeyboardInterrupt


class Cell:
    """Runs a sorter in a folder; everything it used can be looked at afterwards."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "s1"
        self.log_file = folder / "events.jsonl"
        self.control = Control()
        self.robot = Robot()
        self.line = FakeLine(noise=1e-4)
        self.sorter: Sorter | None = None

    @contextmanager
    def open(self, sort_plan: SortPlan, *predictions: Prediction, played=SWEEP, **about):
        sound = None
        card_sound = played
        if not isinstance(played, PassiveRecording):
            sound = excitation_samples(played, RATE_HZ)
            card_sound = sound.astype(np.float32)
        with (
            live_session(
                self.folder,
                DatasetSpec(name="d", excitation=played),
                sound,
                CardSettings(device="fake"),
                {"sort": {"target": "label"}},
                {"source": "soundcard"},
            ) as session,
            EventLog(self.log_file) as log,
        ):
            self.sorter = Sorter(
                plan=sort_plan,
                senses=Scripted(*predictions),
                card=fake_card(self.line),
                played=card_sound,
                robot=self.robot,
                session=session,
                log=log,
                target="label",
                labels=lambda name: {"label": name} if name else {},
                control=self.control,
                **about,
            )
            yield self.sorter

    def run(self, sort_plan: SortPlan, *predictions: Prediction, **about):
        with self.open(sort_plan, *predictions, **about) as sorter:
            return sorter.run()

    def events(self, *kinds: str) -> list:
        """Events of the log, without what differs from run to run."""
        entries = read_events(self.log_file)
        return [entry for entry in entries if not kinds or entry["event"] in kinds]
