"""Sounds to compare -> figures of their spectra, and words: what is heard is also seen."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ajgdata.report.blocks import Illustration
from ajgdata.report.format import Caption, Source, number
from ajgdata.report.kept_figures import made_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE_IN = 5.2, 2.7
#: What is softer, below the peak, is not drawn.
LOWEST_DB = -60.0


class Sound(NamedTuple):
    """A recording that can be heard: `file` is its place below the folder of sounds.

    `facts` are its labels, by name; `spectrum` (f,) is its feature.
    """

    recording: str
    label: str
    file: str
    facts: tuple[tuple[str, str], ...]
    spectrum: NDArray[np.floating]


class SoundPair(NamedTuple):
    """Two sounds of one data set that differ by the grasp alone or by the value of `target`.

    `name` is the file name of their figure, `peak` the highest value of all spectra on one scale.
    """

    name: str
    by_grasp: bool
    target: str
    first: Sound
    second: Sound
    source: Source
    frequency_hz: NDArray[np.float64]
    peak: float
    is_power: bool

    @property
    def title(self) -> str:
        """Return what is compared: `strawberry, grasped twice` or `strawberry and lemon`."""
        first, second = self.first.label, self.second.label
        return f"{first}, grasped twice" if self.by_grasp else f"{first} and {second}"

    @property
    def labels(self) -> tuple[str, str]:
        """Return how the two are told apart, in a word or two."""
        if self.by_grasp:
            return "first grasp", "second grasp"
        return self.first.label, self.second.label

    @property
    def facts(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return what is known to differ between the two, as `angle deg 81.2`, of each."""
        given = dict(self.first.facts), dict(self.second.facts)
        both = dict.fromkeys((*given[0], *given[1]))
        names = [name for name in both if given[0].get(name) != given[1].get(name)]
        first, second = (tuple(f"{n} {one[n]}" for n in names if n in one) for one in given)
        return first, second

    @property
    def percent(self) -> str:
        """Return how far apart the two spectra are, in words: `12 %`."""
        return f"{number(100 * apart(self.first.spectrum, self.second.spectrum), 2)} %"

    @property
    def figure(self) -> Illustration:
        """Return the two spectra on one scale, not drawn yet."""
        draw = partial(pair_figure, self)
        return Illustration(self.name, pair_caption(self), draw, made_of=made_of(self))


class SoundPairs(NamedTuple):
    """Pairs of sounds on one task, the first of which is in all of them; `rule` chose them."""

    rule: str
    pairs: tuple[SoundPair, ...]


def apart(first: NDArray[np.floating], second: NDArray[np.floating]) -> float:
    """Return the distance of two spectra (f,): Euclidean, over the mean of their lengths.

    0 for equal spectra, √2 for spectra of equal length that share no frequency; no more than 2. Two
    silent ones are equal.

    >>> from ajgdata.report.sounds import apart
    >>> import numpy as np
    >>> apart(np.array([3.0, 4.0]), np.array([4.0, 3.0]))  # √2 over 5
    0.28284271247461906
    """
    x, y = np.asarray(first, float), np.asarray(second, float)
    length = (np.linalg.norm(x) + np.linalg.norm(y)) / 2
    return float(np.linalg.norm(x - y) / length) if length > 0 else 0.0


def pair_figure(pair: SoundPair) -> Figure:
    """Both spectra over frequency, in dB against the highest value of all that are compared."""
    from ajgdata.report.canvas import COLOURS, new_figure

    title, about = f"{pair.title}: {pair.percent} apart", "spectra of the two sounds"
    figure = new_figure(SIZE_IN, title, about, [pair.source])
    axes: Axes = figure.subplots()
    styles: tuple[dict[str, Any], ...] = (
        {"color": COLOURS[0], "lw": 1.4},
        {"color": COLOURS[1], "lw": 1.0, "ls": (0, (4, 1.2))},  # told apart without colour
    )
    for sound, label, style in zip((pair.first, pair.second), pair.labels, styles, strict=True):
        axes.plot(pair.frequency_hz / 1e3, _decibels(pair, sound.spectrum), label=label, **style)
    axes.set(xlabel="frequency (kHz)", ylabel="level (dB)", ylim=(LOWEST_DB, 3))
    axes.set_xlim(0, pair.frequency_hz[-1] / 1e3)
    axes.legend(loc="lower left", ncols=2, handlelength=2.6)
    return figure


def _decibels(pair: SoundPair, spectrum: NDArray[np.floating]) -> NDArray[np.float64]:
    factor = 10.0 if pair.is_power else 20.0
    share = np.asarray(spectrum, float) / (pair.peak or 1.0)
    return factor * np.log10(np.maximum(share, 10 ** ((LOWEST_DB - 20) / factor)))


def pair_caption(pair: SoundPair) -> Caption:
    """Return the caption of `pair_figure`."""
    first, second = pair.labels
    return Caption(
        "Spectra as the models see them, in dB against the highest value of the sounds compared "
        "here. How far apart: Euclidean distance over the mean of the two lengths.",
        f"{pair.title}: the spectra of {first} and {second} are {pair.percent} apart.",
    )
