"""Figures read back after they were drawn."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text


def texts(figure: Figure) -> list[str]:
    """Every text that a figure shows."""
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def fits(figure: Figure) -> bool:
    """Everything ends within the canvas, give or take half the width of a line."""
    box, size = figure.get_tightbbox(), figure.get_size_inches()
    return box.min.min() >= -0.5 / 72 and bool(np.all(box.max <= size + 0.5 / 72))
