"""Page of method and cost: skipped measurements, cost by rule, feature settings and provenance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from markupsafe import Markup

from ajgdata.report.format import DASH, number, short_commit, words
from ajgdata.report.render import render_markdown
from ajgdata.report.report_data import DatasetSummary, Report
from ajgdata.store.listing import listed
from ajgdata.types import FeatureKind, FeatureSettings

#: Level of the first heading in the description of a method.
METHOD_HEADING = 3
#: Most names of columns of a table that the feature settings list.
LISTED_COLUMNS = 6
#: What becomes of a recording, for runs with the spectrum of the paper, and with other features.
SPECTRUM_TEXT = (
    "Each recording becomes one spectrum: a short-time Fourier transform, summed over time and "
    "normalised."
)
FEATURE_TEXT = "The table below has the feature of a recording in each data set."


class CostRow(NamedTuple):
    """Cost of the jobs of a rule."""

    rule: str
    jobs: int
    wall_s: str
    cpu_s: str
    peak_mb: str


class SettingsRow(NamedTuple):
    """Feature settings, and the names of the data sets that have them."""

    datasets: str
    values: list[str]


class ProvenanceRow(NamedTuple):
    """Code, settings and inputs of the features of a data set."""

    dataset: str
    commit: str
    config_hash: str
    inputs_hash: str


class Method(NamedTuple):
    """Description of an experiment, as HTML."""

    experiment: str
    title: str
    text: Markup


@dataclass(frozen=True)
class RunView:
    """Values of the template of the page of method and cost."""

    version: str
    commit: str
    feature_text: str
    skipped: tuple[str, ...]
    costs: list[CostRow]
    setting_names: list[str]
    settings: list[SettingsRow]
    provenance: list[ProvenanceRow]
    methods: list[Method]


def run_view(report: Report) -> RunView:
    """Return the values of the page of method and cost."""
    texts = dict.fromkeys(
        (part.experiment, part.title, part.text)
        for section in report.sections
        for part in section.parts
        if part.text
    )
    is_spectrum = all(isinstance(dataset.features, FeatureSettings) for dataset in report.datasets)
    return RunView(
        version=report.version,
        commit=report.commit,
        feature_text=SPECTRUM_TEXT if is_spectrum else FEATURE_TEXT,
        skipped=report.skipped,
        costs=[
            CostRow(
                cost.rule,
                cost.jobs,
                number(cost.wall_s),
                number(cost.cpu_s),
                number(cost.peak_mb),
            )
            for cost in report.run_cost
        ],
        setting_names=[words(name) for name in setting_names(report.datasets)],
        settings=settings_rows(report.datasets),
        provenance=[
            ProvenanceRow(
                dataset.name,
                short_commit(dataset.provenance["commit"]),
                dataset.provenance["config_hash"],
                dataset.provenance["inputs_hash"],
            )
            for dataset in report.datasets
        ],
        methods=[
            Method(experiment, title, render_markdown(text, METHOD_HEADING))
            for experiment, title, text in texts
        ],
    )


def settings_rows(datasets: Sequence[DatasetSummary]) -> list[SettingsRow]:
    """Return one row per different feature settings."""
    names: dict[FeatureKind, list[str]] = {}
    for dataset in datasets:
        names.setdefault(dataset.features, []).append(dataset.name)
    columns = setting_names(datasets)
    rows = []
    for settings, named in names.items():
        values = settings.model_dump()
        texts = [setting_text(values.get(column)) for column in columns]
        rows.append(SettingsRow(", ".join(named), texts))
    return rows


def setting_names(datasets: Sequence[DatasetSummary]) -> list[str]:
    """Return the names of the feature settings of all data sets, each once."""
    names = [name for dataset in datasets for name in type(dataset.features).model_fields]
    return list(dict.fromkeys(names))


def setting_text(value: object) -> str:
    """Return a feature setting for people: text, a number, a band such as `100 to 6,000`, or the
    names of columns."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return number(value, 6)
    if isinstance(value, tuple | list) and all(isinstance(part, str) for part in value):
        return listed([str(part) for part in value], LISTED_COLUMNS)
    if isinstance(value, tuple | list):
        return " to ".join(setting_text(part) for part in value)
    return str(value or DASH)
