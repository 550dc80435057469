"""Parts of a page: figures that are not drawn yet, tables, and rows of the main table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ajgdata.report.format import Caption

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ajgdata.report.paper import PaperFigure


class Illustration(NamedTuple):
    """A figure that is not drawn yet: file name without suffix, words, and how to draw it.

    `folded` names it where it is shown only on request.
    """

    name: str
    caption: Caption
    draw: Callable[[], Figure]
    folded: str = ""


class ShownTable(NamedTuple):
    """A table for people: heads and cells are text; a head that ends in `|` is of numbers.

    It is shown on request; `folded` names it.
    """

    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    folded: str


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
