"""Plan a recording: variance components of a pilot data set, and designs for a required interval.

The score of a recording (correct or not, or a squared error) is modelled as a mean plus independent
random effects of its session, of its object, of the object in this session, of the placement, of
the grasp and of the recording itself. The variance of the mean score of a design is

    V = sum over levels k of s2_k / n_k,

where s2_k is the variance component of level k and n_k the number of its units in the design. The
95 % interval of the mean is ± t V**0.5, with the quantile t of Student's distribution for
(sessions - 1) degrees of freedom. This is also the interval from the means of sessions.

The components are estimated by the method of moments for unbalanced data (Henderson 1953,
Biometrics 9, 226-252, method 1; Searle, Casella & McCulloch 1992, Variance Components, 5.3).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from ajgdata.evaluate.intervals import CONFIDENCE, ROUNDING
from ajgdata.evaluate.metrics import wrapped
from ajgdata.types import Kind

#: Accuracies, their components and half widths are in percent.
PERCENT = 100.0
#: Largest numbers in the search for a design. Objects are varied only if the interval is for new
#: objects.
MAX_SESSIONS = 100
MAX_OBJECTS = 50
MAX_PLACEMENTS = 20
MAX_GRASPS = 30


class DesignLevel(StrEnum):
    """Units that recordings can share, from the outermost level to the innermost.

    Objects are not part of sessions, because an object is in several sessions. The effect of an
    object in a session is the effect of this session on only this object.
    """

    SESSION = "session"
    OBJECT_IN_SESSION = "object in session"
    PLACEMENT = "placement"
    GRASP = "grasp"
    RECORDING = "recording"
    OBJECT = "object"


@dataclass(frozen=True)
class Component:
    """Variance that a level adds to the score of a recording."""

    #: Levels with the same units in the data, outermost first. The data cannot separate them.
    levels: tuple[DesignLevel, ...]
    units: int
    #: Number of units with equally many recordings that would give the mean the same variance:
    #: N² / sum of n_i², with n_i recordings of unit i and N recordings in all.
    effective_units: float
    estimate: float  #: estimate of the variance; it can be negative by chance

    @property
    def name(self) -> str:
        """Return the names of the levels."""
        return " = ".join(self.levels)

    @property
    def variance(self) -> float:
        """Return the estimate, or 0 if it is negative."""
        return max(self.estimate, 0.0)

    @property
    def is_joined(self) -> bool:
        """Return whether this is the variance of several levels."""
        return len(self.levels) > 1

    @property
    def is_of_objects(self) -> bool:
        """Return whether this is the variance between objects that is equal in all sessions."""
        return self.levels == (DesignLevel.OBJECT,)


class RecordingPlan(NamedTuple):
    """Numbers of sessions, objects, placements, grasps and recordings of a plan.

    Each session has all objects.
    """

    sessions: int
    objects: int
    placements: int  #: per object and session
    grasps: int  #: per placement
    recordings: int  #: per grasp

    @property
    def total_placements(self) -> int:
        """Return the number of placements in all sessions."""
        return self.sessions * self.objects * self.placements

    @property
    def total_grasps(self) -> int:
        """Return the number of grasps in all sessions."""
        return self.total_placements * self.grasps

    def units(self, level: DesignLevel) -> int:
        """Return the number of units of a level in the whole design."""
        return {
            DesignLevel.SESSION: self.sessions,
            DesignLevel.OBJECT: self.objects,
            DesignLevel.OBJECT_IN_SESSION: self.sessions * self.objects,
            DesignLevel.PLACEMENT: self.total_placements,
            DesignLevel.GRASP: self.total_grasps,
            DesignLevel.RECORDING: self.total_grasps * self.recordings,
        }[level]


class DesignTimes(NamedTuple):
    """Time that each unit of a plan takes, in minutes."""

    session: float
    placement: float
    grasp: float  #: including its recordings

    def total(self, design: RecordingPlan) -> float:
        """Return the time of a design in minutes."""
        return (
            design.sessions * self.session
            + design.total_placements * self.placement
            + design.total_grasps * self.grasp
        )


def recording_scores(
    y_true: np.ndarray, y_pred: np.ndarray, kind: Kind, period: float | None = None
) -> np.ndarray:
    """Return the score of each recording (n,), in the unit of the half width.

    For a classification, it is 100 for a correct class, otherwise 0. The mean is then the accuracy
    in percent. For a regression, it is the squared error divided by 2 RMSE. To first order, the
    mean of this score changes as the RMSE, so half widths are in the unit of the target.

    >>> import numpy as np
    >>> from ajgdata.evaluate.planning import recording_scores
    >>> recording_scores(np.zeros(2), np.array([1.0, 7.0]), "regression")  # RMSE 5
    array([0.1, 4.9])
    """
    if kind == "classification":
        return PERCENT * np.asarray(y_true == y_pred, float)
    squared = np.square(wrapped(np.asarray(y_pred, float) - np.asarray(y_true, float), period))
    rmse = np.sqrt(np.mean(squared))
    return squared / (2 * rmse) if rmse > 0 else squared


def design_units(
    session: np.ndarray, object_name: np.ndarray, placement: np.ndarray, grasp: np.ndarray
) -> dict[DesignLevel, np.ndarray]:
    """Return the units of each level as numbers (n,), from the labels (n,) of n recordings.

    Equal labels of placements in different sessions or of different objects are different
    placements. Equal labels of grasps in different placements are different grasps.
    """
    in_session = _numbered(session, object_name)
    in_placement = _numbered(in_session, placement)
    return {
        DesignLevel.SESSION: _numbered(session),
        DesignLevel.OBJECT_IN_SESSION: in_session,
        DesignLevel.PLACEMENT: in_placement,
        DesignLevel.GRASP: _numbered(in_placement, grasp),
        DesignLevel.RECORDING: np.arange(len(session)),
        DesignLevel.OBJECT: _numbered(object_name),
    }


def _numbered(*labels: np.ndarray) -> np.ndarray:
    """Return the number (n,) of each combination of labels, each (n,).

    Numbers are counted from 0 in the order of occurrence. Two levels that divide the recordings
    into the same units therefore have the same numbers.
    """
    numbers: dict[tuple[object, ...], int] = {}
    rows = zip(*(label.tolist() for label in labels), strict=True)
    return np.array([numbers.setdefault(row, len(numbers)) for row in rows], int)


def variance_components(
    score: np.ndarray, units: Mapping[DesignLevel, np.ndarray]
) -> tuple[Component, ...]:
    """Return the variance components of `score` (n,), from the units of each level, each (n,).

    A level with one unit has no component. Levels with the same units have one component together.
    For a level f let T_f be the sum over its units of (sum of scores)² / number of recordings, and
    T_0 the same for all recordings as one unit. The expectation of T_f - T_0 is linear in the
    components. This gives one equation per level.
    """
    levels = _distinct_levels(units)
    centred = score - np.mean(score)
    whole = np.zeros(len(score), int)  # all recordings in one unit
    members = [member for _, member in levels]
    whole_coefficients = np.array([_coefficient(whole, k) for k in members])
    coefficients = np.array([[_coefficient(f, k) for k in members] for f in members])
    sums = np.array([_sum_of_squares(centred, f) for f in members])
    estimates = np.linalg.solve(
        coefficients - whole_coefficients, sums - _sum_of_squares(centred, whole)
    )
    is_rounding = np.abs(estimates) <= ROUNDING * np.mean(centred**2)
    estimates = np.where(is_rounding, 0.0, estimates)
    return tuple(
        Component(
            levels=names,
            units=int(member.max()) + 1,
            effective_units=len(score) / _coefficient(whole, member),
            estimate=float(estimate),
        )
        for (names, member), estimate in zip(levels, estimates, strict=True)
    )


def _distinct_levels(
    units: Mapping[DesignLevel, np.ndarray],
) -> list[tuple[tuple[DesignLevel, ...], np.ndarray]]:
    """Return levels with the numbers (n,) of their units, without levels of one unit.

    Levels with the same units are together.
    """
    names: dict[bytes, list[DesignLevel]] = {}
    members: dict[bytes, np.ndarray] = {}
    for level in DesignLevel:
        member = _numbered(units[level])
        if member.any():  # at least two units
            key = member.tobytes()
            members[key] = member
            names.setdefault(key, []).append(level)
    return [(tuple(names[key]), member) for key, member in members.items()]


def _sum_of_squares(score: np.ndarray, member: np.ndarray) -> float:
    """Return T of units `member` (n,): the sum of (sum of scores)² / number of recordings."""
    totals = np.bincount(member, weights=score)
    return float(np.sum(totals**2 / np.bincount(member)))


def _coefficient(member: np.ndarray, source: np.ndarray) -> float:
    """Return the coefficient of the variance between `source` (n,) in T of units `member` (n,).

    With n_ij recordings of unit i and source j, this is the sum over i and j of n_ij² / n_i.
    """
    pairs, counts = np.unique(np.stack([member, source]), axis=1, return_counts=True)
    return float(np.sum(counts**2 / np.bincount(member)[pairs[0]]))


def half_width(
    components: Sequence[Component],
    design: RecordingPlan,
    *,
    new_objects: bool = False,
    at_best: bool = False,
) -> float:
    """Return the half width of the 95 % interval of the mean score of a design.

    The interval is for the objects of the data, or with `new_objects` for all objects of which
    these are a random sample. If the data cannot separate some levels, their variance counts for
    the outermost level, or with `at_best` for the one with the most units in the design.
    The half width is infinite for one session.

    >>> from ajgdata.evaluate.planning import Component, RecordingPlan, DesignLevel, half_width
    >>> session = Component((DesignLevel.SESSION,), 4, 4.0, 16.0)
    >>> f"{half_width([session], RecordingPlan(4, 1, 1, 1, 1)):.3f}"  # t = 3.182, V = 16 / 4
    '6.365'
    """
    variance = 0.0
    for component in _sampled(components, new_objects):
        counts = [design.units(level) for level in component.levels]
        count = max(counts) if at_best else counts[0]
        variance += component.variance / count
    return _mean_half_width(variance, design, new_objects)


def pilot_half_width(
    components: Sequence[Component], pilot: RecordingPlan, *, new_objects: bool = False
) -> float:
    """Return the half width for the data of the components, which can be unbalanced."""
    sampled = _sampled(components, new_objects)
    variance = sum(item.variance / item.effective_units for item in sampled)
    return _mean_half_width(variance, pilot, new_objects)


def _sampled(components: Sequence[Component], new_objects: bool) -> list[Component]:
    """Return the components of units that are different in a repetition of the recording."""
    return [item for item in components if new_objects or not item.is_of_objects]


def _mean_half_width(variance: float, design: RecordingPlan, new_objects: bool) -> float:
    """Return the half width of the 95 % interval of a mean score with this variance."""
    samples = min(design.sessions, design.objects) if new_objects else design.sessions
    if samples < 2:
        return float("inf")
    quantile = stdtrit(samples - 1, (1 + CONFIDENCE) / 2)
    return float(quantile * np.sqrt(variance))


def pilot_design(units: Mapping[DesignLevel, np.ndarray]) -> RecordingPlan:
    """Return the numbers of the data, from the units of each level (n,).

    Numbers per unit, for example grasps per placement, are rounded means.
    """
    counts = {level: len(np.unique(member)) for level, member in units.items()}
    outermost_first = (
        DesignLevel.SESSION,
        DesignLevel.OBJECT_IN_SESSION,
        DesignLevel.PLACEMENT,
        DesignLevel.GRASP,
        DesignLevel.RECORDING,
    )
    ratios = [
        round(counts[inner] / counts[outer]) for outer, inner in itertools.pairwise(outermost_first)
    ]
    return RecordingPlan(counts[DesignLevel.SESSION], *ratios)


def spread_designs(design: RecordingPlan) -> tuple[RecordingPlan, RecordingPlan]:
    """Return two designs with the same number of grasps as `design`.

    Both have one grasp per placement. The first has the same number of sessions, the second as many
    sessions as possible.
    """
    grasps_per_object = design.placements * design.grasps
    return (
        design._replace(placements=grasps_per_object, grasps=1),
        design._replace(sessions=design.sessions * grasps_per_object, placements=1, grasps=1),
    )


def cheapest_design(
    components: Sequence[Component],
    goal: float,
    pilot: RecordingPlan,
    times: DesignTimes,
    *,
    new_objects: bool = False,
) -> RecordingPlan | None:
    """Return the fastest design with a half width of at most `goal`; None if no design has one.

    Of equally fast designs, this is the one with the fewest placements, then with the fewest
    grasps. The number of recordings per grasp is that of `pilot`. The number of objects is also
    that of `pilot`, unless the interval is for `new_objects`. Sizes are up to MAX_SESSIONS,
    MAX_OBJECTS, MAX_PLACEMENTS and MAX_GRASPS.
    """
    best: RecordingPlan | None = None
    best_cost = (float("inf"), 0, 0)
    for outline in _outlines(pilot, new_objects):
        largest = outline._replace(grasps=MAX_GRASPS)
        if half_width(components, largest, new_objects=new_objects) > goal:
            continue
        for grasps in range(1, MAX_GRASPS + 1):
            design = outline._replace(grasps=grasps)
            cost = (times.total(design), design.total_placements, design.total_grasps)
            if cost >= best_cost:
                break  # additional grasps cost time
            if half_width(components, design, new_objects=new_objects) <= goal:
                best = design
                best_cost = cost
                break
    return best


def _outlines(pilot: RecordingPlan, new_objects: bool) -> Iterator[RecordingPlan]:
    """Yield the designs of the search, with one grasp per placement."""
    objects = range(2, MAX_OBJECTS + 1) if new_objects else (pilot.objects,)
    sessions = range(2, MAX_SESSIONS + 1)
    placements = range(1, MAX_PLACEMENTS + 1)
    for numbers in itertools.product(sessions, objects, placements):
        yield RecordingPlan(*numbers, grasps=1, recordings=pilot.recordings)
