"""What changed between two runs, for people: sentences and tables, which console and page share."""

from __future__ import annotations

import math
import re
import statistics
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from ajgdata.report.blocks import ShownTable
from ajgdata.report.comparison import REACH
from ajgdata.report.format import DASH, mean_sd, number, with_unit
from ajgdata.report.run_context import Flips, Setting, Verdict
from ajgdata.report.run_difference import Change, CostChange, Differences, Key

#: Rows that are shown unless all are asked for.
TOP = 20
#: They say again what the first metric of their kind says, and are left out beside it.
SECOND = {"mae": "rmse", "r2": "rmse", "balanced_accuracy": "accuracy", "macro_f1": "accuracy"}
#: Settings are cut after so many characters.
LONGEST = 60
BEYOND = f"beyond {number(REACH)} sd"
CHANGE_HEADS = (
    "Data set / task", "Model", "Part", "Metric", "A|", "B|", "B − A|", "In sd|", "Verdict",
)  # fmt: skip
#: How the column of standard deviations is read.
IN_SD = (
    f"In sd: the difference in standard deviations of itself fold by fold (* of both runs: their "
    f"folds differ); beyond: more than {number(REACH)}."
)
FLIP_HEADS = (
    "Data set / task", "Model", "Split", "Recordings|", "Differ|", "Right only in A|",
    "Right only in B|", "Median move|", "Notes",
)  # fmt: skip


class RunLabel(NamedTuple):
    """A run as it was asked for, the commits that made it, and what else is to be known."""

    name: str
    commits: tuple[str, ...]
    note: str = ""

    def told(self) -> str:
        """Return `results, commit 6483695637 (note)`."""
        short = ", ".join(commit[:10] + "+" * commit.endswith("+") for commit in self.commits)
        commit = f", commit{'s' * (len(self.commits) > 1)} {short}" if short else ""
        return f"{self.name}{commit}" + (f" ({self.note})" if self.note else "")


@dataclass(frozen=True, eq=False)
class RunComparison:
    """All that differs between two runs; `missing` says what could not be compared, and why."""

    a: RunLabel
    b: RunLabel
    numbers: Differences
    flips: tuple[Flips, ...]
    verdicts: tuple[Verdict, ...]
    settings: tuple[Setting, ...]
    missing: tuple[str, ...]

    @property
    def same(self) -> bool:
        """Return whether both have the same numbers, predictions and verdicts."""
        found = self.numbers
        differs = found.changed or found.only_a or found.only_b or self.verdicts
        return not differs and not any(f.changed or f.only_a or f.only_b for f in self.flips)

    def leading(self) -> list[Change]:
        """Return the changes without those that say again what another one says."""
        there = {one.key for one in self.numbers.changed}

        def said(key: Key) -> bool:
            return key._replace(metric=SECOND.get(key.metric, "")) in there

        return [one for one in self.numbers.changed if not said(one.key)]

    def as_json(self) -> dict[str, Any]:
        """Return everything as plain values; a spread that is not known is not a number."""
        changed = [
            {
                **one.key._asdict(),
                "unit": one.b.unit,
                "source": one.b.source,
                "a": {"mean": one.a.score.mean, "sd": one.a.score.sd},
                "b": {"mean": one.b.score.mean, "sd": one.b.score.sd},
                "difference": one.difference,
                "spread": one.spread,
                "paired": one.paired,
                "in_sd": one.ratio,
                "beyond": one.beyond,
                "direction": one.direction,
            }
            for one in self.numbers.changed
        ]
        return {
            "a": self.a._asdict(),
            "b": self.b._asdict(),
            "summary": summary(self),
            "same": self.same,
            "reach_sd": REACH,
            "equal_numbers": len(self.numbers.equal),
            "changed": changed,
            "only_a": [key._asdict() for key in self.numbers.only_a],
            "only_b": [key._asdict() for key in self.numbers.only_b],
            "costs": [{**one._asdict(), "key": one.key._asdict()} for one in self.numbers.costs],
            "predictions": [asdict(one) for one in self.flips],
            "paper": [one._asdict() for one in self.verdicts],
            "settings": [one._asdict() for one in self.settings],
            "not_compared": list(self.missing),
        }  # fmt: skip


def summary(found: RunComparison) -> str:
    """Return in a sentence or two what changed."""
    numbers = found.numbers
    if not numbers.compared:
        return "The runs have no number in common."
    if found.same:
        though = f"; {len(found.settings)} settings or versions differ" if found.settings else ""
        return f"Same numbers: all {numbers.compared:,} of them{though}."
    told = []
    if numbers.changed:
        counts = Counter(one.direction or "neither" for one in numbers.beyond)
        kinds = ", ".join(f"{counts[k]} {k}" for k in ("better", "worse", "neither") if counts[k])
        beyond = f"{len(numbers.beyond)} {BEYOND}" + (f" ({kinds})" if kinds else "")
        told.append(f"{len(numbers.changed):,} of {numbers.compared:,} numbers changed: {beyond}.")
    else:
        told.append(f"The {numbers.compared:,} numbers that both have are the same.")
    flipped = sum(one.changed for one in found.flips if one.classes)
    compared = sum(one.both for one in found.flips if one.classes)
    if flipped:
        told.append(f"{flipped:,} of {compared:,} predicted classes differ.")
    if found.verdicts:
        told.append(f"{len(found.verdicts)} agreements with the paper changed.")
    apart = [
        f"{len(k)} only in {n}" for n, k in (("A", numbers.only_a), ("B", numbers.only_b)) if k
    ]
    if apart:
        told.append(f"Numbers: {', '.join(apart)}.")
    return " ".join(told)


def console_tables(found: RunComparison, everything: bool = False) -> list[ShownTable]:
    """Return the tables for a console: the largest changes unless `everything` is asked for."""
    changed = found.numbers.changed
    shown = list(changed) if everything else found.leading()[:TOP]
    left = len(changed) - len(shown)
    more = f" {left:,} more are on the page, and listed with --all." if left else ""
    only = {"A": found.numbers.only_a, "B": found.numbers.only_b}
    tables = [
        changes_table(shown, f"What changed, beyond its spread first.{more} {IN_SD}"),
        flips_table(found.flips),
        verdicts_table(found.verdicts),
        settings_table(found.settings),
        costs_table(found.numbers.costs),
        only_table(only),
    ]
    filled = [table for table in tables if table.rows]
    if everything:
        return filled
    return [_cut(table) for table in filled]


def _cut(table: ShownTable) -> ShownTable:
    left = len(table.rows) - TOP
    if left <= 0:
        return table
    return table._replace(
        rows=table.rows[:TOP], caption=f"{table.caption} {left:,} more with --all."
    )


def changes_table(changes: Sequence[Change], caption: str) -> ShownTable:
    """Return a row for each change: both numbers, their difference, and what to make of it."""
    return ShownTable(caption, CHANGE_HEADS, tuple(map(_change_row, changes)))


def _change_row(one: Change) -> tuple[str, ...]:
    key, sign = one.key, "+" if one.difference >= 0 else "−"
    unit = "points" if one.unit == "%" else one.unit
    difference = sign + with_unit(number(abs(one.difference) * one.scale), unit)
    first, second = (mean_sd(n.score, one.unit, one.scale) for n in (one.a, one.b))
    place = f"{key.dataset}/{key.task}"
    shown = place, key.model or DASH, key.part, key.metric, first, second, difference
    return (*shown, in_sd(one), verdict(one))


def in_sd(one: Change) -> str:
    """Return how many standard deviations a difference is, with `*` unless it is of pairs; ∞ where
    all folds differ alike."""
    if math.isnan(one.ratio):
        return DASH
    shown = "∞" if math.isinf(one.ratio) else number(one.ratio, 2)
    return shown if one.paired else f"{shown}*"


def verdict(one: Change) -> str:
    """Return `worse, beyond`, `better, within`, or `differs, no spread`."""
    reach = "beyond" if one.beyond else "no spread" if math.isnan(one.ratio) else "within"
    return f"{one.direction or 'differs'}, {reach}"


def flips_table(flips: Iterable[Flips]) -> ShownTable:
    """Return how many held-out predictions differ, for each model and split where any does."""
    rows = []
    for one in flips:
        notes = [f"{one.only_a} only in A"] if one.only_a else []
        notes += [f"{one.only_b} only in B"] if one.only_b else []
        notes += [f"{one.relabelled} have another truth"] if one.relabelled else []
        if not (one.changed or notes):
            continue
        differ = f"{one.changed:,} ({number(100 * one.share)} %)"
        moved = with_unit(number(one.moved), one.unit)
        told = (str(one.lost), str(one.gained), DASH) if one.classes else (DASH, DASH, moved)
        place = f"{one.dataset}/{one.task}", one.model, one.split, f"{one.both:,}", differ
        rows.append((*place, *told, "; ".join(notes)))
    caption = "Held-out predictions of recordings that both runs have."
    return ShownTable(caption, FLIP_HEADS, tuple(rows))


def verdicts_table(verdicts: Iterable[Verdict]) -> ShownTable:
    """Return the figures of the paper with which agreement changed."""
    heads = ("Figure of the paper", "Data set / task", "A agrees", "A", "B agrees", "B")
    rows = ((v.figure, f"{v.dataset}/{v.task}", v.a, v.result_a, v.b, v.result_b) for v in verdicts)
    return ShownTable("Agreement with the paper that changed.", heads, tuple(rows))


def settings_table(settings: Iterable[Setting]) -> ShownTable:
    """Return what differs in how both were made."""
    rows = ((one.key, shortened(one.a), shortened(one.b), _places(one.where)) for one in settings)
    caption = "Settings, versions and hashes that differ: why numbers may."
    return ShownTable(caption, ("Setting", "A", "B", "Where"), tuple(rows))


def shortened(text: str) -> str:
    """Return hashes by their beginning, and long text cut."""
    if re.fullmatch(r"[0-9a-f]{16,}\+?", text):
        return text[:10] + "+" * text.endswith("+")
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"


def _places(where: Sequence[str]) -> str:
    more = f" and {len(where) - 2} more" if len(where) > 2 else ""
    return ", ".join(where[:2]) + more


def costs_table(costs: Iterable[CostChange]) -> ShownTable:
    """Return times and memory as ratios B / A, by what was measured."""
    grouped: dict[str, list[CostChange]] = {}
    for one in costs:  # the largest first
        grouped.setdefault(one.key.metric, []).append(one)
    rows = []
    for metric, some in sorted(grouped.items(), key=lambda pair: -len(pair[1])):
        ratios = [one.ratio for one in some]
        shown = (statistics.median(ratios), min(ratios), max(ratios))
        largest = some[0].key
        place = " ".join(filter(None, (f"{largest.dataset}/{largest.task}", largest.model)))
        rows.append((metric, f"{len(some):,}", *(number(r) for r in shown), place))
    caption = "Times and memory, B / A: they belong to the machines and moments of both runs."
    heads = ("Cost", "Compared|", "Median|", "Least|", "Most|", "Largest change")
    return ShownTable(caption, heads, tuple(rows))


def only_table(keys: Mapping[str, Sequence[Key]]) -> ShownTable:
    """Return how many numbers only one run has, `keys` by its name, by task and model."""
    counts = Counter(
        (run, f"{key.dataset}/{key.task}", key.model or DASH, key.part.partition(":")[0])
        for run, some in keys.items()
        for key in some
    )
    rows = tuple((*place, str(count)) for place, count in counts.items())
    heads = ("Only in", "Data set / task", "Model", "Part", "Numbers|")
    return ShownTable("Numbers that only one run has.", heads, rows)
