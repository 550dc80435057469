"""What a trained model says of one recording, and how far that may be believed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from ajgdata.types import Kind


class Verdict(StrEnum):
    """Whether a prediction is about something that the model knows."""

    KNOWN = "known"
    NOTHING = "nothing"  #: nearer to recordings of an empty gripper, or of silence, than to any
    UNKNOWN = "unknown"  #: further from what was trained on than recordings of new grasps are
    NOT_CHECKED = "not checked"  #: the model has no threshold for novel objects


@dataclass(frozen=True)
class Prediction:
    """One recording as a trained model sees it.

    `value` is the most probable class, or the number in `unit`; it is given for every verdict, and
    meaningless for NOTHING and UNKNOWN. `probability` is calibrated, by class in the order of
    the model's classes (empty for numbers, and for models without probabilities). `interval` holds
    the true number with the model's stated coverage (None for classes). `novelty` is the distance
    to the nearest training grasp in units of the threshold: above 1 is UNKNOWN; None if it was NOT
    CHECKED. `detection_rate` is the share of novel objects that this check detects (None if it was
    not measured): if it is small, KNOWN says little. `remarks` are the warnings of the workflow's
    own checks of the recording, one line each.
    """

    kind: Kind
    value: str | float
    unit: str
    verdict: Verdict
    novelty: float | None
    probability: Mapping[str, float]
    interval: tuple[float, float] | None = None
    remarks: Sequence[str] = ()
    detection_rate: float | None = None

    def plain(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        interval = None if self.interval is None else list(self.interval)
        plain = {"verdict": str(self.verdict), "probability": dict(self.probability)}
        return vars(self) | plain | {"interval": interval, "remarks": list(self.remarks)}
