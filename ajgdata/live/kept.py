"""Recordings of a run: kept as a session, with the labels of the objects that the plan names.

A recording of an unnamed object has `quality: reject`: it is no recording of an empty gripper, and
no model is trained on it before a person fills in its label and quality in recordings.csv.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ajgdata.acquire.card import Capture
from ajgdata.acquire.live_session import REJECTED, LiveSession
from ajgdata.acquire.protocol import PlannedGrasp
from ajgdata.live.predictor import Prediction
from ajgdata.types import DatasetSpec, Recording
from ajgdata.types.plan import NOTHING

#: Columns of recordings.csv beside those of acquisition.
SORT, LOOK, PREDICTED, CONFIDENCE, VERDICT = "sort", "look", "predicted", "confidence", "verdict"
#: Labels of an object by its name, as text.
Labels = Callable[[str], Mapping[str, float | str]]


class KeptRun:
    """The session of one run. `labels` gives the targets of an object by its name.

    `recordings` counts what was recorded.
    """

    def __init__(self, session: LiveSession, labels: Labels) -> None:
        self._session, self._labels, self.recordings = session, labels, 0

    def look(
        self, number: int, look: int, thing: str, capture: Capture, force_n: float | None
    ) -> PlannedGrasp:
        """Keep a look at the object `thing` ("": nobody knows what it is)."""
        held = "" if thing == NOTHING else thing
        targets = self._labels(held) if held else {}
        reference = NOTHING if thing == NOTHING else ""
        grasp = PlannedGrasp(f"sort_{number:04d}_{look}", held, number, 1, targets, reference)
        labels = {SORT: str(number), LOOK: str(look), PREDICTED: "", CONFIDENCE: "", VERDICT: ""}
        labels["force_reached_n"] = "" if force_n is None else f"{force_n:g}"
        self._record(grasp, capture, labels, known=bool(thing))
        return grasp

    def reference(self, number: int, capture: Capture) -> PlannedGrasp:
        """Store a recording of the empty gripper."""
        grasp = PlannedGrasp(f"{NOTHING}_{number:04d}", "", number, 1, {}, NOTHING)
        self._record(grasp, capture, {}, known=True)
        return grasp

    def said(self, grasp: PlannedGrasp, prediction: Prediction) -> None:
        """Enter what the model said of a look."""
        confidence = max(prediction.probability.values(), default=None)
        labels = {
            PREDICTED: str(prediction.value),
            CONFIDENCE: "" if confidence is None else f"{confidence:.4f}",
            VERDICT: str(prediction.verdict),
        }
        self._session.label(grasp, labels)

    def name(self, grasp: PlannedGrasp) -> str:
        """Return the name of its recording in the feature store."""
        return f"{self._session.folder.name}/{grasp.name}_1"

    def _record(
        self, grasp: PlannedGrasp, capture: Capture, labels: Mapping[str, str], known: bool
    ) -> Recording:
        quality = ("clipped" if capture.clipped else "ok") if known else REJECTED
        every = {**capture.labels(), **labels}
        self.recordings += 1
        return self._session.record(grasp, 1, 0, capture.samples, quality=quality, labels=every)


def class_of(spec: DatasetSpec, target: str, name: str) -> str | None:
    """Return the class of the object `name` by recipe or protocol; None if they do not list it."""
    if target == "object":
        return name
    value = _declared_targets(spec, name).get(target)
    return None if value is None else str(value)


def labels_of(spec: DatasetSpec, target: str, name: str) -> dict[str, float | str]:
    """Return all targets of the object `name`; nothing if its class is unknown."""
    value = class_of(spec, target, name)
    known = {} if value is None else {**_declared_targets(spec, name), target: value}
    return {key: known[key] for key in sorted(known) if key != "object"}  # has its own column


def _declared_targets(spec: DatasetSpec, name: str) -> dict[str, float | str]:
    """Return the targets of an object that the recipe or the protocol lists."""
    sources = [source for source in (spec.recipe, spec.protocol) if source]
    objects = {made.name: made for source in sources for made in source.objects}
    return dict(objects[name].targets) if name in objects else {}
