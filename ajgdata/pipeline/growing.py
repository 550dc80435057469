"""A run whose report is still to come -> its first page, which grows with the results.

When a run begins, it notes what its report waits for; while the note is there, jobs that measure
write the page anew. The report itself is made at the end, from nothing of this: it takes the note
away before it writes its pages, which are the same as if nothing had stood there. A page that is
no growing one, which its time tells, is never written over.
"""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace

from ajgdata.experiments import EXPERIMENTS, Asked
from ajgdata.experiments.base import TaskResults
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import TaskKey, asked_for, read_results, with_page_tests
from ajgdata.report.growing import Growing, Waiting, render_growing
from ajgdata.report.panel import Panel, panels
from ajgdata.report.paper import PaperFigure, parse_paper
from ajgdata.report.report_data import Part, TaskSection
from ajgdata.store.files import json_bytes, read_json, replacing, write_bytes
from ajgdata.store.report_files import read_paper
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DatasetSpec

#: Jobs that end sooner after the last one leave the page as it is.
EVERY_S = 60.0
#: The page has this time (s; 1 January 1996): older than all that the report is made of, so that a
#: run which finds it, left by one that was killed or failed, makes the report.
BACKDATED_S = 820_454_400


def begin(paths: Paths, datasets: Sequence[str], tasks: Sequence[TaskKey]) -> None:
    """Note what the report on `datasets` and `tasks` waits for, and write its first page, unless a
    report is there: an older one stays until the new one is made."""
    if not _is_free(paths):
        return
    note = {"run": paths.run, "datasets": list(datasets), "tasks": [list(one) for one in tasks]}
    write_bytes(paths.growing, json_bytes(note))
    with _harmless():
        _write(paths)


def grow(root: Paths) -> None:
    """Write the pages of project `root` whose reports are to come anew, if some time has passed."""
    for note in root.all_growing():
        with _harmless():
            paths = replace(root, run=read_json(note)["run"])
            since = time.time() - note.stat().st_mtime
            if not paths.report.is_file() or since >= EVERY_S:
                _write(paths)


def stop(paths: Paths, failed: Sequence[str] = ()) -> None:
    """Say on the page that the run ended without its report, if it did; it grows no more. `failed`
    names the jobs that ended in an error, with their logs."""
    if paths.growing.is_file():
        with _harmless():
            _write(paths, stopped=True, failed=failed)
        end(paths)


def discard(paths: Paths) -> None:
    """Remove a page that a killed or failed run left, and its note: where files are only made to
    look new, it would look like the report."""
    end(paths)
    if _is_free(paths):
        paths.report.unlink(missing_ok=True)


def end(paths: Paths) -> None:
    """Take the note away: the report is made."""
    paths.growing.unlink(missing_ok=True)


@contextmanager
def _harmless() -> Iterator[None]:
    """Tell of a mistake, and go on: what the page is told of is not lost because the page is."""
    try:
        yield
    except Exception:
        traceback.print_exc()


def _is_free(paths: Paths) -> bool:
    """Return whether no report is there: nothing, or a growing page."""
    try:
        return int(paths.report.stat().st_mtime) == BACKDATED_S
    except FileNotFoundError:
        return True


def _write(paths: Paths, *, stopped: bool = False, failed: Sequence[str] = ()) -> None:
    note = read_json(paths.growing)
    tasks = [(dataset, task) for dataset, task in note["tasks"]]
    specs = {name: read_dataset(paths, name) for name in note["datasets"]}
    paper = parse_paper(read_paper(paths))
    asked = asked_for(specs, tasks)
    parts = [_made_of(paths, one) for one in asked]
    is_made = [part.models == one.models for one, part in zip(asked, parts, strict=True)]
    shown = [p for p, whole in zip(parts, is_made, strict=True) if whole or (stopped and p.models)]
    read = [read_results(paths, one, specs, paper)[0] for one in shown]
    results = with_page_tests([one for one in read if one.results])
    content = Growing(
        title="Acoustic sensing with jamming grippers",
        made=sum(is_made),
        asked=len(asked),
        panels=tuple(_panels(results, paper)),
        sections=tuple(_sections(results)),
        waiting=tuple(
            _waiting(specs, [one for one, made in zip(asked, is_made, strict=True) if not made])
        ),
        stopped=stopped,
        failed=tuple(failed),
    )
    page = render_growing(content, paths).encode()
    if not _is_free(paths):
        return
    with replacing(paths.report) as temporary:
        temporary.write_bytes(page)
        os.utime(temporary, (BACKDATED_S, BACKDATED_S))
    with suppress(FileNotFoundError):  # the report was made in the meantime
        os.utime(paths.growing)


def _made_of(paths: Paths, asked: Asked) -> Asked:
    """Return an experiment on a task with those of its models whose results are there."""

    def is_made(kind: str) -> bool:
        one = (asked.dataset, asked.task, kind)
        return paths.experiment(*one).is_file() and paths.experiment_cost(*one).is_file()

    models = zip(asked.models, asked.kinds, strict=True)
    return replace(asked, models=tuple(model for model, kind in models if is_made(kind)))


def _panels(results: Sequence[TaskResults], paper: Mapping[str, PaperFigure]) -> Iterator[Panel]:
    """Yield what stands beside the paper so far; its pages are not there yet."""
    from ajgdata.pipeline.report import comparisons

    for one in panels(comparisons(results, paper, ()), paper.values()):
        if one.source is not None:
            yield replace(one, link="")


def _sections(results: Sequence[TaskResults]) -> Iterator[TaskSection]:
    """Yield the rows of the table of results so far, by task."""
    for dataset, task in dict.fromkeys((one.dataset, one.task) for one in results):
        own = [one for one in results if (one.dataset, one.task) == (dataset, task)]
        parts = tuple(_part(one) for one in own)
        yield TaskSection(dataset, task, own[0].title, own[0].source, parts)


def _part(results: TaskResults) -> Part:
    one = EXPERIMENTS[results.experiment]
    rows = tuple(one.rows(results))
    return Part(one.name, results.named(), results.page, one.title, "", "", rows, (), ())


def _waiting(specs: Mapping[str, DatasetSpec], asked: Sequence[Asked]) -> Iterator[Waiting]:
    """Yield what is still computed, by data set."""
    for dataset in dict.fromkeys(one.dataset for one in asked):
        own = [one for one in asked if one.dataset == dataset]
        titles = dict.fromkeys(EXPERIMENTS[one.experiment.name].title for one in own)
        yield Waiting(specs[dataset].title or dataset, len(own), tuple(titles))
