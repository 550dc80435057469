"""The interactive scatter plot: complete, escaped, and no other script can run."""

import base64
import dataclasses
import hashlib
import re

import numpy as np
import pytest
from embedding_samples import SCRIPT, SETTINGS, THINGS, pictures, projections
from html_page import Page

from ajgdata.pipeline import explorer
from ajgdata.pipeline.explorer import build_explorer
from ajgdata.report.explorer import Explored, render_explorer, scatter
from ajgdata.report.projections import MISSING
from ajgdata.store.tables import write_tables
from ajgdata.types import Target

MORE = "../../experiments/embedding_projections.html"
ONE = Explored("Things", "simulated", SETTINGS["supervision"], MORE, pictures())


@pytest.fixture(scope="module")
def html():
    return render_explorer(ONE)


def test_only_scripts_whose_hash_the_policy_names_can_run(html):
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", html, flags=re.DOTALL)
    policy = next(a["content"] for t, a in Page(html).tags if t == "meta" and "http-equiv" in a)
    allowed = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    digests = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    assert len(scripts) == 3
    assert allowed["script-src"].split() == [f"'sha256-{digest}'" for digest in digests]
    assert allowed["default-src"] == "'none'" and SCRIPT not in html


def test_it_needs_no_other_file_and_is_the_same_each_time(html):
    page = Page(html)
    assert not {tag for tag, _ in page.tags} & {"link", "iframe", "object", "img"}
    assert {a[key] for _, a in page.tags for key in ("src", "href") if key in a} == {MORE}
    assert render_explorer(ONE) == html
    words = " ".join(page.words)
    assert "simulated" in words and f"Which things are the same, and {SCRIPT}." in words


def test_each_recording_is_drawn_once_per_column_in_its_colour():
    shown = pictures()
    traces = scatter(shown).data
    first = [trace for trace in traces if trace.visible]
    assert sorted(trace.name.replace("&lt;", "<").replace("&gt;", ">") for trace in first) == (
        sorted(THINGS)
    )
    places = {
        text.split("<br>")[0]: (x, y, symbol)
        for trace in first
        for text, x, y, symbol in zip(
            trace.text, trace.x, trace.y, trace.marker.symbol, strict=True
        )
    }
    points = shown.projections[0].points
    for name, point, trained in zip(shown.recording, points, shown.training, strict=True):
        assert places[name][:2] == pytest.approx(point, rel=1e-4)
        assert places[name][2] == ("circle" if trained else "circle-open")
    angles = [trace for trace in traces if trace.marker.showscale]
    assert len(angles) == 1 and np.ptp(angles[0].marker.color) == pytest.approx(180)
    unknown = [trace for trace in traces if trace.marker.color == MISSING]
    assert [len(trace.x) for trace in unknown] == [1]  # the angle of one recording is not known
    assert "angle deg: —" in unknown[0].text[0]


def test_the_menus_choose_space_and_colours():
    shown = pictures()
    figure = scatter(shown)
    spaces, colours = figure.layout.updatemenus
    assert [one.label for one in spaces.buttons][:2] == ["latent · 2-D", "latent · PCA"]
    assert len(spaces.buttons) == len(shown.projections)
    count = len(figure.data)
    for button in spaces.buttons:
        assert [len(x) for x in button.args[0]["x"]] == [len(trace.x) for trace in figure.data]
    assert [one.label for one in colours.buttons] == [
        "object", "category", "angle deg", "session id",
    ]  # fmt: skip
    visible = np.array([button.args[0]["visible"] for button in colours.buttons])
    assert visible.shape == (4, count) and np.all(visible.sum(axis=0) == 1)


def test_an_embedding_without_projections_says_why():
    html = render_explorer(ONE._replace(shown=None, skipped=SCRIPT))
    assert "<script" not in html and f"There are no projections: {SCRIPT}" in Page(html).words


def built(project, **about):
    """The page as text; `about` is what the file of the projections says."""
    kind = Target(kind="classification").model_dump()
    project.declare(
        title=f"Things {SCRIPT}",
        targets={"object": kind, "category": kind},
        embeddings={"poses": SETTINGS},
    )
    path, page = project.root / "projections.json", project.root / "explorer.html"
    recordings, points, _ = projections()
    rows = tuple({**row, "recording": f"s1/r{i:02d}"} for i, row in enumerate(recordings.rows))
    tables = [dataclasses.replace(recordings, rows=rows), points]
    skipped = "skipped" in about
    write_tables(path, [] if skipped else tables, provenance={"source": "recorded"}, **about)
    build_explorer(path, dataset="d", embedding="poses", paths=project.paths, page=page)
    return Page(page.read_text(encoding="utf-8"))


def test_the_page_names_data_set_and_source(project):
    page = built(project)
    words = " ".join(page.words)
    assert f"Things {SCRIPT} · poses" in words and "recorded" in words
    assert MORE in {a.get("href") for _, a in page.tags}


def test_of_too_many_recordings_some_are_shown_and_the_page_says_so(project, monkeypatch):
    monkeypatch.setattr(explorer, "MOST_SHOWN", 6)
    assert "6 of 32 recordings are shown" in " ".join(built(project).words)
    words = " ".join(built(project, available=5000).words)
    assert "6 of 5,000 recordings are shown" in words


def test_an_embedding_that_was_not_trained_has_a_page_that_says_why(project):
    words = built(project, skipped="one thing only").words
    assert "There are no projections: one thing only" in words
