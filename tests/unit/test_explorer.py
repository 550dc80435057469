"""The interactive scatter plot: complete, escaped, and no other script can run."""

import base64
import hashlib
import html
import re

import numpy as np
import pytest
from embedding_samples import SCRIPT, SETTINGS, pictures
from html_page import Page

from ajgdata.report.explorer import (
    Explored,
    point_table,
    render_explorer,
    scatters,
    space_label,
)

MORE = "../../experiments/embedding_projections.html"
ONE = Explored("Things", "simulated", SETTINGS["supervision"], MORE, pictures(), 5000)


@pytest.fixture(scope="module")
def text():
    return render_explorer(ONE)


def test_only_scripts_whose_hash_the_policy_names_can_run(text):
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", text, flags=re.DOTALL)
    policy = next(a["content"] for t, a in Page(text).tags if t == "meta" and "http-equiv" in a)
    allowed = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    digests = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    assert len(scripts) > 4  # plotly, and two per column
    assert allowed["script-src"].split() == [f"'sha256-{digest}'" for digest in digests]
    assert allowed["default-src"] == "'none'" and SCRIPT not in text


def test_each_recording_has_its_place_in_each_space_and_its_labels():
    shown = pictures()
    points = point_table(shown)
    assert len(points) == len(shown.projections) * len(shown.recording)
    first = points[points["space"] == space_label(shown.projections[0])]
    assert first["recording"].map(html.unescape).tolist() == shown.recording.tolist()
    x, y = np.asarray(shown.projections[0].points, float).T
    assert first["part"].eq("training").tolist() == shown.training.tolist()
    assert np.corrcoef(first["x"], x)[0, 1] == pytest.approx(1)
    assert np.corrcoef(first["y"], y)[0, 1] == pytest.approx(1)
    assert first[["x", "y"]].abs().to_numpy().max() == pytest.approx(1)
    assert point_table(shown, 6)["recording"].nunique() == 6
    plots = list(scatters(shown, points))
    columns = ["object", "category", "angle deg", "session id"]
    assert [plot.layout.title.text for plot in plots] == [f"Colour: {name}" for name in columns]
    assert all(len(plot.frames) == len(shown.projections) for plot in plots)
    assert SCRIPT not in plots[0].to_json()
