"""What changed between two runs beside their numbers: predictions, verdicts, settings."""

from __future__ import annotations

import contextlib
import json
import statistics
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ajgdata.report.format import DASH
from ajgdata.report.run_difference import ROUNDING, Key, Numbers

#: Keys of an experiment's description that are no settings.
CONTENT = ("tables", "cost", "dataset", "task", "experiment", "model", "provenance", "skipped")
GROUPED = "grouped"
SOFTWARE = "software"

Rows = Sequence[Mapping[str, str]]
Place = tuple[str, str, str, str]  #: data set, task, model, split


@dataclass(frozen=True)
class Flips:
    """Held-out predictions of one model on one split of a task, of the recordings in both runs.

    `changed` of `both` differ; of classes `lost` were right in A and are wrong in B, `gained` the
    opposite; of numbers, `moved` is the median of |B - A| of those that differ. `relabelled`
    recordings have another truth.
    """

    dataset: str
    task: str
    model: str
    split: str
    classes: bool
    both: int
    only_a: int
    only_b: int
    changed: int
    lost: int = 0
    gained: int = 0
    moved: float = 0.0
    relabelled: int = 0
    unit: str = ""

    @property
    def share(self) -> float:
        """Return the share of recordings whose prediction differs."""
        return self.changed / self.both if self.both else 0.0


class Verdict(NamedTuple):
    """Agreement with a figure of the paper that changed, and the results that it is of."""

    figure: str
    dataset: str
    task: str
    a: str
    b: str
    result_a: str
    result_b: str


class Setting(NamedTuple):
    """A setting, version or hash that differs, and where; DASH: not there."""

    key: str
    a: str
    b: str
    where: tuple[str, ...]


def flips(a: Rows, b: Rows, numbers: Numbers) -> list[Flips]:
    """Compare rows of two predictions.csv; `numbers` (of B) tell classes from numbers.

    The share that differs is largest first.
    """
    first, second = _by_split(a), _by_split(b)
    accuracies = {key[:3] for key in numbers.scores if key.metric == "accuracy"}
    units = {key[:3]: n.unit for key, n in numbers.scores.items() if key.metric == "rmse"}
    found = []
    for where in first.keys() & second.keys():
        dataset, task, model, split = where
        before, after = first[where], second[where]
        both = before.keys() & after.keys()
        pairs = [(before[name], after[name]) for name in both]
        classes = where[:3] in accuracies
        counts = _of_classes(pairs) if classes else _of_numbers(pairs)
        found.append(
            Flips(
                dataset,
                task,
                model,
                split,
                classes=classes,
                both=len(both),
                only_a=len(before.keys() - both),
                only_b=len(after.keys() - both),
                relabelled=sum(x["y_true"] != y["y_true"] for x, y in pairs),
                unit=units.get(where[:3], ""),
                **counts,
            )
        )
    return sorted(found, key=lambda one: (-one.share, one.dataset, one.task, one.model, one.split))


def _by_split(rows: Rows) -> dict[Place, dict[tuple[str, int], Mapping[str, str]]]:
    """Return rows by data set, task, model and split, then by recording; a recording that several
    folds predict has several, counted."""
    found: dict[Place, dict[tuple[str, int], Mapping[str, str]]] = defaultdict(dict)
    seen: Counter[tuple[str, ...]] = Counter()
    for row in rows:
        where = row["dataset"], row["task"], row["model"], row["split"]
        nth = seen[(*where, row["recording"])]
        seen[(*where, row["recording"])] += 1
        found[where][row["recording"], nth] = row
    return found


def _of_classes(pairs: Iterable[tuple[Mapping[str, str], Mapping[str, str]]]) -> dict[str, Any]:
    changed = [(x, y) for x, y in pairs if x["y_pred"] != y["y_pred"]]
    right = [(x["y_pred"] == x["y_true"], y["y_pred"] == y["y_true"]) for x, y in changed]
    counted = {"lost": right.count((True, False)), "gained": right.count((False, True))}
    return {"changed": len(changed), **counted}


def _of_numbers(pairs: Iterable[tuple[Mapping[str, str], Mapping[str, str]]]) -> dict[str, Any]:
    given = [(float(x["y_pred"]), float(y["y_pred"])) for x, y in pairs]
    moved = [abs(y - x) for x, y in given if abs(y - x) > ROUNDING * max(abs(x), abs(y), 1.0)]
    return {"changed": len(moved), "moved": statistics.median(moved) if moved else 0.0}


def known_folds(a: Rows, b: Rows) -> Callable[[Key], bool]:
    """Return whether the folds of a number's task hold the same recordings in both runs.

    Of a task without predictions the others of its data set are asked; where there are none, folds
    are taken to be the same: they follow from the recordings and the seed.
    """
    first, second = _folds(a), _folds(b)
    tasks = {where: first[where] == second[where] for where in first.keys() & second.keys()}
    datasets: dict[str, bool] = {}
    for (dataset, _), same in tasks.items():
        datasets[dataset] = datasets.get(dataset, True) and same

    def same_folds(key: Key) -> bool:
        return tasks.get((key.dataset, key.task), datasets.get(key.dataset, True))

    return same_folds


def _folds(rows: Rows) -> dict[tuple[str, str], dict[str, str]]:
    """Return the fold of each recording, by data set and task."""
    found: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
    for row in rows:
        if row["split"] == GROUPED:
            found[row["dataset"], row["task"]][row["recording"]] = row["fold"]
    return found


def verdicts(a: Rows, b: Rows) -> list[Verdict]:
    """Return the figures of the paper whose agreement changed, of rows of two beside-paper.csv."""
    first = {_of_figure(row): row for row in a}
    pairs = [(first[_of_figure(row)], row) for row in b if _of_figure(row) in first]
    return [
        Verdict(*_of_figure(y), x["agrees"], y["agrees"], x["result"], y["result"])
        for x, y in pairs
        if x["agrees"] != y["agrees"]
    ]


def _of_figure(row: Mapping[str, str]) -> tuple[str, str, str]:
    return row["figure"], row["dataset"], row["task"]


def settings(a: Described, b: Described) -> list[Setting]:
    """Compare how two runs were made, in the data sets and experiments that both have.

    What differs alike in several places is said once. Where one run says less (its layout is older,
    or its metrics.json is missing), both are asked for what metrics.csv has alone.
    """
    whole = a.told and b.told
    first, second = (one.places if whole else one.commits() for one in (a, b))
    grouped: dict[tuple[str, str, str], list[str]] = defaultdict(list)
    for where in first.keys() & second.keys():
        before, after = dict(_leaves(first[where])), dict(_leaves(second[where]))
        for key in before.keys() | after.keys():
            pair = before.get(key, DASH), after.get(key, DASH)
            if pair[0] != pair[1]:
                grouped[key, *pair].append(where)
    listed = [Setting(*told, tuple(sorted(where))) for told, where in grouped.items()]
    return sorted(listed, key=lambda one: (one.where[0] != SOFTWARE, one.key, one.where))


@dataclass(frozen=True, eq=False)
class Described:
    """How a run was made: `document` is its metrics.json, {} if there is none, `rows` those of its
    metrics.csv."""

    document: Mapping[str, Any]
    rows: Rows

    @property
    def told(self) -> bool:
        """Return whether the document says how each experiment was made."""
        return "experiments" in self.document

    @property
    def places(self) -> dict[str, dict[str, Any]]:
        """Return what is told, by place: its software, each data set, each experiment."""
        found = {SOFTWARE: dict(self.document.get("software", {}))}
        for one in self.document["experiments"]:
            about = {key: value for key, value in one.items() if key not in CONTENT}
            name = " ".join(filter(None, (one["experiment"], one["model"])))
            found[f"{one['dataset']}/{one['task']} {name}"] = about
            found[f"data set {one['dataset']}"] = dict(one["provenance"])
        return found

    def commits(self) -> dict[str, dict[str, Any]]:
        """Return commit and seed of each data set, which metrics.csv has."""
        made = {(row["dataset"], row["commit"], row["seed"]) for row in self.rows if row["seed"]}
        return {f"data set {d}": {"git_commit": c, "seed": s} for d, c, s in sorted(made)}


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """Yield the plain values of nested settings by dotted key; text that is JSON is opened."""
    if isinstance(value, str) and value.startswith("{"):
        with contextlib.suppress(ValueError):
            value = json.loads(value)
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _leaves(inner, f"{key}.{name}" if key else str(name))
    else:
        yield key, value if isinstance(value, str) else json.dumps(value)
