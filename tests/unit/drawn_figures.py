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


def smallest_pt(figure: Figure) -> float:
    """The smallest type that a figure shows, in points at a width of 7.2 in; wider ones shrink."""
    shown = [text for text in figure.findobj(Text) if text.get_text() and text.get_visible()]
    return min(text.get_size() for text in shown) * min(1.0, 7.2 / figure.get_figwidth())
