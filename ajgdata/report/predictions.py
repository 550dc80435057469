"""Predictions that a page lists with their recordings, so that people can hear wrong ones."""

from __future__ import annotations

from typing import NamedTuple


class ListedPrediction(NamedTuple):
    """A prediction on a held-out grasp.

    `link` leads from the report to the sound, and is "" without one. `certainty` is the probability
    of the predicted class, or the error. `pair` is the anchor of its true and predicted class.
    """

    recording: str
    link: str
    true: str
    predicted: str
    certainty: str
    pair: str
    is_wrong: bool

    @property
    def predicted_text(self) -> str:
        """Return the predicted class, with a tick if it is correct."""
        return self.predicted if self.is_wrong else f"{self.predicted} ✓"


class ShownPrediction(NamedTuple):
    """A listed prediction; the first one of each pair of classes has an anchor for the matrix."""

    prediction: ListedPrediction
    anchor: str


class MatrixCell(NamedTuple):
    """A cell of a matrix of classes: a number of predictions, and the anchor of listed ones.

    `command` shows all recordings of the cell; it is "" without recordings.
    """

    text: str
    anchor: str
    is_correct: bool
    command: str


class MatrixRow(NamedTuple):
    """The predictions of the recordings of one true class."""

    true: str
    cells: tuple[MatrixCell, ...]


class PredictionList(NamedTuple):
    """Predictions of one model on the held-out grasps of a task.

    `name` is the anchor of the list, and `classes` are the titles of the columns of the `matrix`;
    both are empty for numbers. `certainty_title` is the title of the last column. `command` shows
    all wrong predictions, or all predictions of numbers.
    """

    name: str
    title: str
    note: str
    certainty_title: str
    command: str
    rows: tuple[ListedPrediction, ...]
    classes: tuple[str, ...] = ()
    matrix: tuple[MatrixRow, ...] = ()

    @property
    def has_sound(self) -> bool:
        """Whether a listed recording has a sound; rows of tables have none."""
        return any(row.link for row in self.rows)

    @property
    def shown(self) -> list[ShownPrediction]:
        """Return the rows with their anchors."""
        first = {row.pair: row for row in reversed(self.rows)}
        return [
            ShownPrediction(row, row.pair if first[row.pair] is row else "") for row in self.rows
        ]
