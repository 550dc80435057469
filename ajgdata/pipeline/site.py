"""Pages of a report on experiments: which there are, and what they ask."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from ajgdata.experiments.requests import Request, page_of
from ajgdata.paths import Paths
from ajgdata.report.comparison import parse_paper
from ajgdata.report.report_data import ExperimentPage
from ajgdata.store.report_files import read_experiment_text, read_page_text, read_paper
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec

#: Groups of the navigation: experiments of the paper, and all other experiments.
PAPER_GROUP, OTHER_GROUP = "The paper's experiments", "Beyond the paper"
#: Section of a page's text that is printed above its comparison with the paper.
COMPARISON = "Comparison with the paper"
TASKS = "Tasks"  #: group of the pages if no result is compared with the paper


def pages_of(
    paths: Paths, specs: Mapping[str, DatasetSpec], requests: Sequence[Request]
) -> list[ExperimentPage]:
    """Return the pages on experiments: first those of the paper, in the paper's order."""
    grouped: dict[str, list[Request]] = {}
    for request in requests:
        grouped.setdefault(page_of(request, specs[request.dataset]), []).append(request)
    ids = list(parse_paper(read_paper(paths)))
    places = {name: _place(some, specs, ids) for name, some in grouped.items()}
    second = OTHER_GROUP if any(place < len(ids) for place in places.values()) else TASKS
    return [
        _page(paths, name, grouped[name], specs, PAPER_GROUP if places[name] < len(ids) else second)
        for name in sorted(grouped, key=lambda name: places[name])
    ]


def _place(requests: Iterable[Request], specs: Mapping[str, DatasetSpec], ids: list[str]) -> int:
    """Return the place of the first published value of a page, or the end."""
    named: list[str] = []
    for request in requests:
        if request.experiment.of_embedding:
            named.append(request.experiment.paper)
        else:
            named += specs[request.dataset].tasks[request.task].papers.values()
    return min((ids.index(name) for name in named if name in ids), default=len(ids))


def _page(
    paths: Paths,
    name: str,
    requests: Sequence[Request],
    specs: Mapping[str, DatasetSpec],
    group: str,
) -> ExperimentPage:
    """Return a page with its words: its own, if a task names it, or those on its experiment.

    Raises DataError where a data set is named like the page that an experiment has of its own.
    """
    first, spec = requests[0], specs[requests[0].dataset]
    on_tasks = [request for request in requests if not request.experiment.of_embedding]
    named = any(name == specs[request.dataset].tasks[request.task].page for request in on_tasks)
    written = read_page_text(paths, name) if named else ""
    if on_tasks and len(on_tasks) < len(requests):
        where = paths.dataset(on_tasks[0].dataset)
        raise DataError(where, f"{name} is the page of an experiment", "rename it")
    apart = [request for request in requests if request.experiment.name != CROSS_VALIDATION]
    experiment = apart[0].experiment.name if apart else CROSS_VALIDATION
    text = written or read_experiment_text(paths, experiment)
    title = heading(text) if written or not on_tasks else spec.title or spec.name
    return ExperimentPage(
        name=name,
        title=title or first.experiment.title,
        question=section_of(text, "Question"),
        command=f"ajgdata run {' '.join(dict.fromkeys(request.dataset for request in requests))}",
        about=group,
        comparison_note=section_of(written, COMPARISON),
    )


def heading(markdown: str) -> str:
    """Return the first heading of a text, or nothing."""
    match = re.search(r"^# +(.+?)\s*$", markdown, re.MULTILINE)
    return match[1] if match else ""


def section_of(markdown: str, title: str) -> str:
    """Return what stands below a heading of the second level, or nothing."""
    parts = re.split(r"^## +(.+?)\s*$", markdown, flags=re.MULTILINE)
    named = dict(zip(parts[1::2], parts[2::2], strict=True))
    return named.get(title, "").strip()
