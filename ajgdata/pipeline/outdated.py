"""Reasons of outdated results in words, from the reasons that Snakemake reports in a dry run.

Snakemake stores the parameters of a job without their names. The form of a value therefore has to
show what it is: the digests of features and recipes begin with FEATURES and RECIPE, other digests
are of code, and mappings are settings of dataset.yaml.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ajgdata.types import many

#: First words of parameters that are digests of the features, or of a recipe.
FEATURES = "features"
RECIPE = "recipe"
MISSING = "not computed yet"
#: Name of the results of a rule for people, with the wildcards of the job in braces.
NAMES = {
    "acquire": "simulated session {session}",
    "features": "features",
    "experiment": "experiment {experiment} of {task} ({models})",
    "train": "model {model} of {task}",
    "embed": "embedding {embedding}",
    "publish_dataset": "published data set",
    "study": "study {study}",
    "opening": "opening picture of the report",
    "collect": "metrics and predictions",
    "collect_everything": "metrics and predictions of everything",
    "report": "report",
    "report_everything": "report on everything",
    "complete": "summary",
    "complete_everything": "summary of everything",
}
#: Rules whose parameters also contain digests of texts and of dataset.yaml.
WITH_TEXTS = ("publish_dataset", "report", "report_everything", "complete", "complete_everything")
#: Values of `device` of the config (`ajgdata.models.device`, which loads slowly).
DEVICES = ("cpu", "cuda", "auto")
# Snakemake's words for reasons, with what follows them.
_UPDATED = "Updated input files: "
_WILL_BE_UPDATED = "Input files updated by another job: "
_PARAMS = "Params have changed since last execution: "
_OTHER_REASONS = {
    "Incomplete output files: ": "its last computation was interrupted",
    "Set of input files has changed": "it needs other results than before",
    "Forced execution": "requested by --force or --forcerun",
}
#: Parameters before and now, each a list of Python literals.
_BEFORE_AND_NOW = re.compile(r"before: (?P<before>.*) now: (?P<now>.*)$", re.DOTALL)
#: Remark on a file in Snakemake's lists.
_REMARK = re.compile(r" \(\w+\)$")
_NOTHING = "<nothing exclusive>"


@dataclass(frozen=True)
class PlannedJob:
    """A job that Snakemake would run, with the reason in Snakemake's words.

    `missing` are those of its output files that do not exist.
    """

    rule: str
    wildcards: Mapping[str, str]
    outputs: tuple[str, ...]
    missing: tuple[str, ...]
    reason: str

    @property
    def dataset(self) -> str:
        """The data set of the results; "" for results of a run."""
        return self.wildcards.get("dataset", "")

    @property
    def is_missing(self) -> bool:
        """Whether none of the results exists."""
        return bool(self.missing) and set(self.outputs) == set(self.missing)

    @property
    def name(self) -> str:
        """The name of the results for people, without the data set."""
        return NAMES.get(self.rule, self.rule).format_map(self.wildcards)


def files_in(texts: Sequence[str]) -> tuple[str, ...]:
    """Return the files of a list of Snakemake, without its remarks.

    >>> files_in(["results/features/size.nc (update)"])
    ('results/features/size.nc',)
    """
    return tuple(_REMARK.sub("", text) for text in texts)


def reasons(
    job: PlannedJob, jobs: Sequence[PlannedJob], changes: Mapping[str, Sequence[str]]
) -> list[str]:
    """Return the reasons of a job in words.

    `jobs` are all jobs that Snakemake would run. `changes` are the changes since the features, by
    data set (`store.freshness.changes_since_features`).
    """
    if job.is_missing:
        return [MISSING]
    texts = list(changes.get(job.dataset, ())) if job.rule == "features" else []
    if job.missing:
        texts.append(f"{_some(job.missing)} is missing")
    updated = _listed(job.reason, _UPDATED)
    if updated and not texts:
        texts.append(f"{_some(updated)} changed")
    producers = _producers(_listed(job.reason, _WILL_BE_UPDATED), job, jobs)
    if producers:
        texts.append(f"its input is outdated: {_some(producers)}")
    match = _BEFORE_AND_NOW.search(_after(job.reason, _PARAMS))
    if match and not texts:
        texts += changed_params(literals(match["before"]), literals(match["now"]), job.rule)
    texts += [text for words, text in _OTHER_REASONS.items() if words in job.reason]
    return list(dict.fromkeys(texts)) or ["Snakemake gives no reason"]


def literals(text: str) -> list[Any]:
    """Return the Python values in a list of their representations.

    Returns an empty list if Snakemake lists no values, or values that are not literals.

    >>> literals("{'folds': 3},'cpu',7")
    [{'folds': 3}, 'cpu', 7]
    """
    if text.strip() == _NOTHING:
        return []
    try:
        return list(ast.literal_eval(f"[{text.strip()}]"))
    except (ValueError, SyntaxError):
        return []


def changed_params(before: Sequence[Any], now: Sequence[Any], rule: str) -> list[str]:
    """Return a clause for each parameter of a job that changed.

    `before` and `now` are the values that only the last and only the next job have.

    >>> changed_params([{"folds": 3, "seed": 0}], [{"folds": 5, "seed": 0}], "experiment")
    ['its settings in dataset.yaml changed (folds)']
    """
    clauses = [_clause(value, before, rule) for value in now]
    if not now:
        clauses = ["its settings changed"]
    return list(dict.fromkeys(clauses))


def _clause(value: Any, before: Sequence[Any], rule: str) -> str:
    """Return a clause for one parameter with a new value; `before` are the values that changed."""
    clause = "other results are requested than before"
    if isinstance(value, dict):
        earlier = [item for item in before if isinstance(item, dict)]
        keys = min((changed_keys(item, value) for item in earlier), key=len, default=[])
        named = f" ({', '.join(keys)})" if keys else ""
        clause = f"its settings in dataset.yaml changed{named}"
    elif isinstance(value, bool):
        clause = "`quick` of the config changed"
    elif isinstance(value, int):
        clause = "`seed` of the config changed"
    elif value in DEVICES:
        clause = "`device` of the config changed"
    elif isinstance(value, str) and value.startswith(FEATURES):
        clause = "its features changed"
    elif isinstance(value, str) and value.startswith(RECIPE):
        clause = "the recipe changed"
    elif isinstance(value, str) and rule in WITH_TEXTS:
        clause = "dataset.yaml, a text or a template changed, or this version of ajgdata differs"
    elif isinstance(value, str):
        clause = "this version of ajgdata or a library computes it differently"
    return clause


def changed_keys(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """Return the keys with different values, in nested settings joined by dots.

    >>> changed_keys({"a": 1, "b": {"c": 2, "d": 3}}, {"b": {"c": 2, "d": 4}})
    ['a', 'b.d']
    """
    keys = []
    for key in sorted({*before, *now}):
        old = before.get(key)
        new = now.get(key)
        if old == new:
            continue
        if isinstance(old, dict) and isinstance(new, dict):
            keys += [f"{key}.{inner}" for inner in changed_keys(old, new)]
        else:
            keys.append(str(key))
    return keys


def _after(reason: str, words: str) -> str:
    """Return the text after the words of a reason; "" if the reason does not have them."""
    return reason.partition(words)[2]


def _listed(reason: str, words: str) -> list[str]:
    """Return the files that a reason lists after `words`."""
    text = _after(reason, words).partition("; ")[0]
    return list(files_in(text.split(", "))) if text else []


def _producers(files: Sequence[str], job: PlannedJob, jobs: Sequence[PlannedJob]) -> list[str]:
    """Return the names of the results that contain `files`, with the data set if it is another."""
    wanted = set(files)
    names = []
    for other in jobs if wanted else ():
        if not wanted.isdisjoint(other.outputs):
            is_same = other.dataset in ("", job.dataset)
            names.append(other.name if is_same else f"{other.name} of {other.dataset}")
    return list(dict.fromkeys(names))


def _some(names: Sequence[str]) -> str:
    """Return one name as it is, of several the first and the number of the others."""
    if len(names) == 1:
        return names[0]
    return f"{names[0]} and {many(len(names) - 1, 'other result')}"


def grouped(
    jobs: Sequence[PlannedJob], changes: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, str, list[str]]]:
    """Yield (data set, reasons, names of results), for the first of each data set and reasons."""
    groups: dict[tuple[str, str], list[str]] = {}
    for job in jobs:
        key = job.dataset, ", ".join(reasons(job, jobs, changes))
        groups.setdefault(key, []).append(job.name)
    for (dataset, text), names in groups.items():
        yield dataset, text, names
