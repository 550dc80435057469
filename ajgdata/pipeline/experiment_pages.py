"""Pages of experiments in the report: their order, groups, titles and questions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from ajgdata.experiments.requests import Request, page_of
from ajgdata.paths import Paths
from ajgdata.report.report_data import ExperimentPage
from ajgdata.store.report_files import read_experiment_text, read_page_text
from ajgdata.types import CROSS_VALIDATION, DataError, DatasetSpec

#: Groups of the navigation: experiments of the paper, and all other experiments.
PAPER_GROUP = "The paper's experiments"
OTHER_GROUP = "Beyond the paper"
#: Group of all pages if no result is compared with the paper.
ONLY_GROUP = "Tasks"
#: Section of a page's text that is printed above its comparison with the paper.
COMPARISON = "Comparison with the paper"


def experiment_pages(
    paths: Paths,
    specs: Mapping[str, DatasetSpec],
    requests: Sequence[Request],
    published: Sequence[str],
) -> list[ExperimentPage]:
    """Return the pages of experiments: first those of the paper, in the paper's order.

    `published` are the ids of the published values in this order. Raises DataError if a data set
    has the name of a page of an experiment.
    """
    by_page: dict[str, list[Request]] = {}
    for request in requests:
        by_page.setdefault(page_of(request, specs[request.dataset]), []).append(request)
    places = {name: _place(on_page, specs, published) for name, on_page in by_page.items()}
    of_paper = {name for name, place in places.items() if place < len(published)}
    pages = []
    for name in sorted(by_page, key=lambda name: places[name]):
        if name in of_paper:
            group = PAPER_GROUP
        elif of_paper:
            group = OTHER_GROUP
        else:
            group = ONLY_GROUP
        pages.append(_page(paths, name, by_page[name], specs, group))
    return pages


def _place(
    requests: Iterable[Request], specs: Mapping[str, DatasetSpec], published: Sequence[str]
) -> int:
    """Return the place of the first published value of a page in the paper, or the end."""
    named: list[str] = []
    for request in requests:
        if request.experiment.of_embedding:
            named.append(request.experiment.paper)
        else:
            named += specs[request.dataset].tasks[request.task].papers.values()
    places = [published.index(name) for name in named if name in published]
    return min(places, default=len(published))


def _page(
    paths: Paths,
    name: str,
    requests: Sequence[Request],
    specs: Mapping[str, DatasetSpec],
    group: str,
) -> ExperimentPage:
    """Return a page with its texts: its own text if a task names it, else that of its experiment.

    Raises DataError if a data set has the name of the page of an experiment on embeddings.
    """
    on_tasks = [request for request in requests if not request.experiment.of_embedding]
    has_own_text = any(
        name == specs[request.dataset].tasks[request.task].page for request in on_tasks
    )
    own_text = read_page_text(paths, name) if has_own_text else ""
    if on_tasks and len(on_tasks) < len(requests):
        dataset = paths.dataset(on_tasks[0].dataset)
        raise DataError(dataset, f"{name} is the page of an experiment", "rename it")
    experiments = [request.experiment.name for request in requests]
    additional = [experiment for experiment in experiments if experiment != CROSS_VALIDATION]
    experiment = additional[0] if additional else CROSS_VALIDATION
    text = own_text or read_experiment_text(paths, experiment)
    spec = specs[requests[0].dataset]
    title = heading(text)
    if on_tasks and not own_text:
        title = spec.title or spec.name
    datasets = dict.fromkeys(request.dataset for request in requests)
    return ExperimentPage(
        name=name,
        title=title or requests[0].experiment.title,
        question=section_of(text, "Question"),
        command=f"ajgdata run {' '.join(datasets)}",
        about=group,
        comparison_note=section_of(own_text, COMPARISON),
    )


def heading(markdown: str) -> str:
    """Return the first heading of a text; "" if it has none."""
    match = re.search(r"^# +(.+?)\s*$", markdown, re.MULTILINE)
    return match[1] if match else ""


def section_of(markdown: str, title: str) -> str:
    """Return the text below the heading `title` of the second level; "" without this heading."""
    parts = re.split(r"^## +(.+?)\s*$", markdown, flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    return sections.get(title, "").strip()
