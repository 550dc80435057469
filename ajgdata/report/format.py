"""Numbers and words for people, in every figure, table and caption."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

Source = Literal["simulated", "recorded"]
#: Points that an alternative text lists.
MAX_LISTED = 60
DASH = "—"
NO_BREAK = "\N{NO-BREAK SPACE}"


class Score(NamedTuple):
    """A metric over folds: mean, standard deviation, and the value of each fold.

    `low` and `high` are the ends of the 95 % interval of the mean, if the split was repeated.
    """

    mean: float
    sd: float
    per_fold: tuple[float, ...] = ()
    low: float = math.nan
    high: float = math.nan

    @property
    def has_interval(self) -> bool:
        """Return whether the ends of an interval are known."""
        return math.isfinite(self.low) and math.isfinite(self.high)

    def bars(self, scale: float = 1.0) -> list[list[float]]:
        """Return the lengths of an error bar below and above the mean, (2, 1) for matplotlib.

        The bar reaches to the ends of the interval, or one standard deviation without an interval.
        It has no length if the deviation is unknown.
        """
        if self.has_interval:
            below = self.mean - self.low
            above = self.high - self.mean
        else:
            below = above = self.sd if math.isfinite(self.sd) else 0.0
        return [[abs(scale) * max(below, 0.0)], [abs(scale) * max(above, 0.0)]]


class Caption(NamedTuple):
    """Text below a figure, and the alternative text for people who cannot see it."""

    text: str
    alt: str


def number(value: float, digits: int = 3) -> str:
    """Return a number with `digits` significant digits, without exponent or trailing zeros.

    Infinity is `∞`; NaN is a dash.
    """
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if math.isnan(value):
        return DASH
    if value == 0:
        return "0"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:,.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def value(content: float | str | None) -> str:
    """Return the text of a cell: yes or no, the text itself, three digits, or a dash for None.

    Numbers below 0.001 and from 100,000 on have a power of ten.
    """
    if content is None:
        return DASH
    if isinstance(content, bool):
        return "yes" if content else "no"
    if isinstance(content, str):
        return content
    if isinstance(content, int):
        return f"{content:,}".replace("-", "−")
    if content == 0 or not math.isfinite(content) or 1e-3 <= abs(content) < 1e5:
        return number(content).replace("-", "−")
    mantissa, exponent = f"{content:.2e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".").replace("-", "−")
    return f"{mantissa} × 10{str(int(exponent)).translate(_SUPERSCRIPT)}"


def with_unit(text: str, unit: str) -> str:
    """Return `text` and a unit: no space before the degree sign, nothing after a bare number."""
    if unit in ("", "°"):
        return f"{text}{unit}"
    return f"{text} {unit}"


def column_title(text: str, unit: str) -> str:
    """Return the title of a column with its unit after a comma, which `table_of` reads."""
    return f"{text}, {unit}" if unit else text


def mean_sd(score: Score, unit: str = "", scale: float = 1.0) -> str:
    """Return a score such as `2.63 ± 0.21 mm`, or `2.63 (2.4 to 2.86) mm` with an interval.

    The deviation has two significant digits, and the mean as many decimals.
    """
    if score.has_interval:
        ends = f"{number(score.low * scale)} to {number(score.high * scale)}"
        return with_unit(f"{number(score.mean * scale)} ({ends})", unit)
    mean = score.mean * scale
    sd = score.sd * scale
    if math.isnan(mean):
        return DASH
    if not (math.isfinite(sd) and sd > 0):
        return with_unit(number(mean), unit)
    decimals = min(max(0, 1 - math.floor(math.log10(sd))), 4)
    return with_unit(f"{mean:.{decimals}f} ± {sd:.{decimals}f}", unit)


def enumerated(items: Sequence[str]) -> str:
    """Return items with commas, and `and` before the last.

    >>> from ajgdata.report.format import enumerated
    >>> enumerated(["40", "80", "160"])
    '40, 80 and 160'
    """
    *first, last = items
    if not first:
        return last
    return f"{', '.join(first)} and {last}"


def shortened(text: str, longest: int) -> str:
    """Return the first complete words of a text, up to `longest` characters with the mark ` …`.

    >>> from ajgdata.report.format import shortened
    >>> shortened("a text of six short words", 14)
    'a text of …'
    """
    mark = " …"
    if len(text) <= longest:
        return text
    return text[: longest - len(mark)].rsplit(" ", 1)[0] + mark


def short_commit(commit: str) -> str:
    """Return the first ten digits of a commit."""
    return commit[:10]


def web_link(url: str) -> str:
    """Return `url` if it is an address of the web, else ""."""
    return url if url.startswith(("https://", "http://")) else ""


def words(name: str) -> str:
    """Return a column or task name as words: `edge_mm` -> `edge mm`."""
    return name.replace("_", " ")


def sentence(text: str) -> str:
    """Return `text` with a capital letter, if its first word has only small letters."""
    first = text.split(maxsplit=1)[0] if text.strip() else ""
    if first.strip(",;:").isalpha() and first.islower():
        return text[:1].upper() + text[1:]
    return text
