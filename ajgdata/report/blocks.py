"""Parts of a page: figures that are not drawn yet, and rows of the main table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ajgdata.report.format import Caption

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ajgdata.report.paper import PaperFigure


class Illustration(NamedTuple):
    """A figure that is not drawn yet: file name without suffix, words, and how to draw it."""

    name: str
    caption: Caption
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class ResultRow:
    """A row of the table of results; what a row does not have is empty.

    `answer` is the value with its interval, of the best model of a task.
    """

    label: str
    metric: str
    value: str
    chance: str = ""
    train_s: str = ""
    inference_ms: str = ""
    peak_memory_mb: str = ""
    best: bool = False
    part: str = ""  #: heading of the rows that it stands among
    paper: PaperFigure | None = None
    answer: str = ""
