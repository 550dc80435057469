"""Page of the data sets: sizes, licences, spectra, and issues of recordings."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ajgdata.paths import Paths
from ajgdata.report.format import DASH, Source, sentence, shortened, web_link
from ajgdata.report.navigation import link_from_report
from ajgdata.report.render import DrawnFigure
from ajgdata.report.report_data import DatasetSummary, IssueLine, Report, findings_by_code
from ajgdata.types import Finding

#: Characters of a description that the page shows.
MAX_DESCRIPTION = 240


class IssueGroup(NamedTuple):
    """Issues with the same consequence, one line per code."""

    title: str
    lines: list[IssueLine]


@dataclass(frozen=True)
class DatasetView:
    """A data set on the page. `published` is the link to its published folder, or ""."""

    name: str
    title: str
    source: Source
    n_recordings: str
    n_sessions: int
    sample_rate_hz: str
    n_quarantined: int
    issues: str
    licence: str
    published: str
    description: str
    is_shortened: bool
    citation: str
    url: str
    figures: list[DrawnFigure]
    issue_groups: list[IssueGroup]
    quarantine_link: str


@dataclass(frozen=True)
class DatasetsView:
    """Values of the template of the page of data sets."""

    datasets: list[DatasetView]
    has_published: bool


def datasets_view(
    report: Report,
    figures: Mapping[str, DrawnFigure],
    published: Collection[str],
    project: Paths,
) -> DatasetsView:
    """Return the values of the page; `published` are the names of published data sets."""
    datasets = [_dataset(dataset, figures, published, project) for dataset in report.datasets]
    return DatasetsView(datasets, bool(published))


def _dataset(
    dataset: DatasetSummary,
    figures: Mapping[str, DrawnFigure],
    published: Collection[str],
    project: Paths,
) -> DatasetView:
    name = dataset.name
    description = shortened(dataset.description, MAX_DESCRIPTION)
    return DatasetView(
        name=name,
        title=dataset.title,
        source=dataset.source,
        n_recordings=f"{dataset.n_recordings:,}",
        n_sessions=dataset.n_sessions,
        sample_rate_hz=f"{dataset.sample_rate_hz:,}" if dataset.features.needs_waveform else DASH,
        n_quarantined=dataset.n_left_out,
        issues=str(dataset.issues),
        licence=dataset.licence,
        published=link_from_report(project, project.published(name)) if name in published else "",
        description=description,
        is_shortened=description != dataset.description,
        citation=dataset.citation,
        url=web_link(dataset.url),
        figures=[figures[dataset.spectra_name]] if dataset.spectra_name in figures else [],
        issue_groups=issue_groups(dataset.findings),
        quarantine_link=link_from_report(project, project.quarantine(name)),
    )


def issue_groups(findings: Iterable[Finding]) -> list[IssueGroup]:
    """Return issues by consequence: quarantined recordings, warnings and notes."""
    groups: dict[str, list[Finding]] = {"Quarantined": [], "Used with a warning": [], "Notes": []}
    for finding in findings:
        if finding.leaves_out:
            groups["Quarantined"].append(finding)
        elif finding.level == "warning":
            groups["Used with a warning"].append(finding)
        elif finding.level == "note":
            groups["Notes"].append(finding)
    return [IssueGroup(title, issue_lines(issues)) for title, issues in groups.items() if issues]


def issue_lines(findings: Iterable[Finding]) -> list[IssueLine]:
    """Return one line per code, in alphabetical order, with the first issue as the example."""
    lines = []
    for code, issues in findings_by_code(findings):
        first = issues[0]
        place = f"{first.session_id}/{first.recording_id}"
        example = f"{place}: {first.problem}. {sentence(first.fix)}."
        lines.append(IssueLine(len(issues), code, example))
    return lines
