"""The protocol of a source of recordings: what it offers, and what is asked of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from ajgdata.types import DataError


@dataclass(frozen=True)
class Grasp:
    """One placement of one object, and how often it is recorded.

    `setup` is what the source needs to know of it (for the virtual gripper: the scene), `digest`
    identifies it, so that a recording already made of the same grasp is not made again.
    """

    grasp_id: str
    object: str
    samples: int
    targets: Mapping[str, float | str]
    setup: Mapping[str, Any]
    digest: str

    def recording_id(self, sample: int) -> str:
        """Return the name of one of its recordings; `sample` counts from 0."""
        return f"{self.grasp_id}_{sample + 1}"


@dataclass(frozen=True)
class Take:
    """One recording: samples (n,) in [-1, 1] of full scale, and how many were clipped."""

    samples: np.ndarray
    clipped: int = 0


class GraspError(DataError):
    """A grasp that cannot be made; the others can."""


class Source(Protocol):
    """A speaker and a microphone in a gripper, real or virtual.

    A source is used for one session: `excitation()` once, then for each grasp `take` for
    each of its samples, in order. `describe()` is kept in session.yaml.
    """

    @property
    def kind(self) -> Literal["virtual", "soundcard"]:
        """Kind of recordings: "virtual" if they can be made again, the same, else "soundcard"."""
        ...

    @property
    def sample_rate_hz(self) -> int:
        """Rate of all samples."""
        ...

    def excitation(self) -> np.ndarray | None:
        """Return the sound that is played, (n,) in [-1, 1]; None where nothing is."""
        ...

    def take(self, grasp: Grasp, sample: int) -> Take:
        """Play once and record. Raises GraspError for a grasp that cannot be made."""
        ...

    def describe(self) -> Mapping[str, Any]:
        """Return keys of Session: `gripper`, `medium`, `device`, `scene`; of `excitation`, if
        something is played, `description` and `settings`."""
        ...
