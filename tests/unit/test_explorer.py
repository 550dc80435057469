"""The interactive scatter plot: complete, escaped, and no other script can run."""

import base64
import hashlib
import re

import numpy as np
import pytest
from embedding_samples import SCRIPT, SETTINGS, SPACES, projections
from html_page import Page

from ajgdata.experiments.embedding_projections import point_table
from ajgdata.report.explorer import render_explorer, scatters


def test_only_scripts_whose_hash_the_policy_names_can_run():
    text = render_explorer(
        point_table(projections()), title="Things", source="simulated", available=5000, skipped="",
        supervision=SETTINGS["supervision"], more="../../experiments/embedding_projections.html",
    )  # fmt: skip
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", text, flags=re.DOTALL)
    policy = next(a["content"] for t, a in Page(text).tags if t == "meta" and "http-equiv" in a)
    allowed = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    digests = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    assert len(scripts) > 4  # plotly, and two per column
    assert allowed["script-src"].split() == [f"'sha256-{digest}'" for digest in digests]
    assert allowed["default-src"] == "'none'" and SCRIPT not in text


def test_each_recording_has_its_place_in_each_space_and_its_labels():
    recordings, places = projections()
    points = point_table([recordings, places])
    assert len(points) == len(SPACES) * len(recordings.rows)
    first = points[points["space"] == "latent · 2-D"]
    for key in ("recording", "object", "session_id"):
        assert first[key].tolist() == recordings.column(key)
    assert first["part"].eq("training").tolist() == recordings.column("training")
    for key in ("x", "y"):
        own = places.where(method="plane").numbers(key)
        assert np.corrcoef(first[key], own)[0, 1] == pytest.approx(1)
    assert first[["x", "y"]].abs().to_numpy().max() == pytest.approx(1)
    assert point_table([recordings, places], 6)["recording"].nunique() == 6
    plots = list(scatters(points))
    columns = ["object", "category", "angle deg", "session id"]
    assert [plot.layout.title.text for plot in plots] == [f"Colour: {name}" for name in columns]
    assert all(len(plot.frames) == len(SPACES) for plot in plots)
    assert SCRIPT not in plots[0].to_json()
