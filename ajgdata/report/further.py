"""What a report says of learning curves, tests against chance and sorting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ajgdata.report.format import Source
from ajgdata.report.paper import PaperFigure


@dataclass(frozen=True)
class About:
    """Which task it is about, and what the figure's head says of it."""

    dataset: str
    task: str
    title: str
    source: Source


@dataclass(frozen=True, eq=False)
class CurveLine:
    """One model: groups per class (n,), mean and sd (n,) of the metric over the draws."""

    model_label: str
    groups: np.ndarray
    mean: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True, eq=False)
class Curves:
    """Learning curves of a task; shares are in per cent."""

    about: About
    metric: str
    unit: str
    repeats: int
    chance: float
    lines: tuple[CurveLine, ...]
    paper: PaperFigure | None = None

    @property
    def name(self) -> str:
        """File name of the figure, without suffix."""
        return f"curve--{self.about.dataset}--{self.about.task}"


@dataclass(frozen=True, eq=False)
class ChanceTest:
    """Permutation test of a task; `value` and `null` (permutations,) as its metric is computed."""

    about: About
    model_label: str
    metric: str
    unit: str
    value: float
    null: np.ndarray
    p: float

    @property
    def differs(self) -> bool:
        """Whether it differs from chance at 5 %."""
        return self.p < 0.05

    @property
    def name(self) -> str:
        """File name of the figure, without suffix."""
        return f"chance--{self.about.dataset}--{self.about.task}"


@dataclass(frozen=True, eq=False)
class SortingPart:
    """With probabilities as they are, or scaled by a temperature. `confidence` and `accuracy` (n,)
    of the bins of the reliability diagram; `sorts`, `before_mistake` (runs,)."""

    label: str
    confidence: np.ndarray
    right: np.ndarray
    calibration_error: float
    accepted_share: float
    accepted_accuracy: float
    sorts: np.ndarray
    before_mistake: np.ndarray


@dataclass(frozen=True, eq=False)
class SortingResult:
    """Simulated sorting of some objects by one model."""

    about: About
    model: str
    model_label: str
    objects: tuple[str, ...]
    threshold: float
    recordings: int
    accuracy: float
    parts: tuple[SortingPart, ...]
    paper: PaperFigure | None = None

    @property
    def name(self) -> str:
        """File name of the figure, without suffix."""
        return f"sorting--{self.about.dataset}--{self.about.task}--{self.model}"


class Row(NamedTuple):
    """A row of the table of results that is of no evaluated model."""

    label: str
    metric: str
    value: str


@dataclass(frozen=True)
class EnergyPart:
    """One class of recordings: energy against that of the reference, see `evaluate.energy`."""

    label: str
    groups: int
    mean: float
    sd: float
    by_object: Mapping[str, float]


@dataclass(frozen=True)
class Energies:
    """How much sound comes back, by class; 1 is the reference."""

    about: About
    reference: str
    band_hz: tuple[float, float]
    parts: tuple[EnergyPart, ...]
    paper: PaperFigure | None = None

    @property
    def name(self) -> str:
        """File name of the figure, without suffix."""
        return f"energies--{self.about.dataset}--{self.about.task}"


@dataclass(frozen=True, eq=False)
class TransferLine:
    """One model on one other gripper: calibration grasps of each class (n,), mean and sd (n,) of
    the metric over folds; `home` (mean, sd) on the gripper that it was trained on, or NaN."""

    model_label: str
    dataset: str
    title: str
    grasps: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    home: tuple[float, float]
    chance: float


@dataclass(frozen=True, eq=False)
class Transfers:
    """Models of a task on other grippers; shares are in per cent."""

    about: About
    metric: str
    unit: str
    folds: int
    lines: tuple[TransferLine, ...]
    paper: PaperFigure | None = None

    @property
    def name(self) -> str:
        """File name of the figure, without suffix."""
        return f"transfer--{self.about.dataset}--{self.about.task}"


class StftPoint(NamedTuple):
    """One setting of the STFT: the feature's run time, and the error of each model (mean, sd)."""

    window: int
    hop: int
    band_hz: tuple[float, float] | None
    bins: int
    feature_ms: float
    errors: tuple[tuple[float, float], ...]

    @property
    def label(self) -> str:
        """Window, hop and band in short."""
        return f"{self.window}/{self.hop}" + (f", {self.band}" if self.band_hz else "")

    @property
    def band(self) -> str:
        """The band in kHz."""
        return "{:g}–{:g}".format(*(hz / 1000 for hz in self.band_hz)) if self.band_hz else "all"


@dataclass(frozen=True)
class StftResult:
    """Settings of the STFT on a task; the first point is the data set's own. Errors of classes are
    100 - accuracy in per cent, of numbers the RMSE in `unit`."""

    about: About
    model_labels: tuple[str, ...]
    metric: str
    unit: str
    chance: float
    points: tuple[StftPoint, ...]

    @property
    def name(self) -> str:
        """File name of the figure, without suffix."""
        return f"stft--{self.about.dataset}--{self.about.task}"


Further = Curves | ChanceTest | SortingResult | Energies | Transfers | StftResult


class Experiments(NamedTuple):
    """Further experiments on one task."""

    curves: tuple[Curves, ...]
    tests: tuple[ChanceTest, ...]
    sorting: tuple[SortingResult, ...]
    energies: tuple[Energies, ...]
    transfers: tuple[Transfers, ...]
    stfts: tuple[StftResult, ...]
