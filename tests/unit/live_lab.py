"""A laboratory in this process: a protocol, a fake card, and operators who follow a script."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import yaml
from fake_card import FakeLine, fake_card

from ajgdata.acquire.operator import Choice, OperatorDecision
from ajgdata.paths import Paths
from ajgdata.pipeline import acquire_live as module
from ajgdata.pipeline.acquire_live import acquire_live

PROTOCOL = {
    "gripper": "mine",
    "medium": "rice",
    "objects": [{"name": n, "targets": {"label": n}} for n in ("cube", "ball")],
    "grasps_per_object": 2,
    "samples_per_grasp": 2,
    "wait_s": 0,
}
EXCITATION = {"kind": "log_sweep", "length_s": 0.2}
TARGETS = {"label": {"kind": "classification"}, "mass_g": {"kind": "regression", "unit": "g"}}


def declare(paths: Paths, **changes: object) -> None:
    """A data set `d` whose protocol is PROTOCOL with `changes`."""
    path = paths.dataset("d")
    path.parent.mkdir(parents=True, exist_ok=True)
    content = {"name": "d", "targets": TARGETS, "excitation": EXCITATION}
    content |= {"protocol": PROTOCOL | changes}
    path.write_text(yaml.safe_dump(content, sort_keys=False))


class Scripted:
    """An operator whose answers are known beforehand; requests and shown values are kept.

    `confirms` maps the number of a question (from 0) to a choice or an exception; `decisions` are
    used one after another.
    """

    attended = True

    def __init__(self, decisions=(), confirms=None):
        self.decisions = list(decisions)
        self.confirms = dict(confirms or {})
        self.calls = []
        self.usual_dbfs = []
        self.announced = []
        self.problems = []
        self.notes = []

    def note(self, text):
        self.notes.append(text)

    def announce(self, grasp, done, total):
        self.announced.append((grasp.name, done, total))

    def confirm(self, text):
        self.calls.append(text)
        answer = self.confirms.get(len(self.calls) - 1)
        if isinstance(answer, Choice):
            raise OperatorDecision(answer)
        if answer is not None:
            raise answer

    def show(self, peak_dbfs, usual_dbfs, problems, repeated):
        self.usual_dbfs.append(usual_dbfs)

    def decide(self, problem, choices):
        self.problems.append((problem, tuple(choices)))
        return self.decisions.pop(0)


def response(seed: int = 0) -> np.ndarray:
    """A plant whose response is short, and not the same twice."""
    noise = np.random.default_rng(seed).standard_normal(64)
    return 0.15 * noise * np.exp(-np.arange(64) / 12)


class Lab:
    """Acquires with a fake card; `lines` are used one an acquisition, then fresh ones."""

    def __init__(self, paths: Paths, monkeypatch) -> None:
        self.paths = paths
        self.lines = []
        self.used = []
        monkeypatch.setattr(module, "open_card", self._open)

    @contextmanager
    def _open(self, settings):
        noise = 1e-4 * (1 + len(self.used) / 10)  # so that no two recordings are the same
        line = self.lines.pop(0) if self.lines else FakeLine(response(), noise=noise)
        self.used.append(line)
        card = fake_card(line, **settings.model_dump(exclude={"device"}))
        try:
            yield card
        finally:
            card.close()

    def acquire(self, operator, session=""):
        return acquire_live(self.paths, "d", session, device={"device": "fake"}, operator=operator)

    def folder(self, session="soundcard-01"):
        return self.paths.session("d", session)
