"""The page on which recordings are seen and heard: whole, escaped, and nothing else can run."""

import base64
import dataclasses
import hashlib
import json
import re

import numpy as np
import pytest
from embedding_samples import SCRIPT, THINGS, pictures, sample
from html_page import Page
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ajgdata.report.interactive import (
    HEIGHT,
    MARGIN,
    STEPS,
    WIDTH,
    content,
    placed,
    render_interactive,
)
from ajgdata.report.projected import MISSING

CLIPS = {"s0/r0": b"\xff\xfb sound", "s1/r1": b"<more>"}


@pytest.fixture(scope="module")
def html():
    return render_interactive(sample(), CLIPS, f"Packed & {SCRIPT}.")


def scripts(html):
    return re.findall(r"<script([^>]*)>(.*?)</script>", html, flags=re.DOTALL)


def test_only_the_script_whose_hash_the_policy_names_can_run(html):
    (kind, data), (plain, script) = scripts(html)
    assert plain == "" and 'type="application/json"' in kind
    policy = next(a["content"] for t, a in Page(html).tags if t == "meta" and "http-equiv" in a)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    allowed = dict(part.strip().split(" ", 1) for part in policy.split(";"))
    assert allowed == {
        "default-src": "'none'",
        "img-src": "data:",
        "style-src": "'unsafe-inline'",
        "media-src": "data:",
        "script-src": f"'sha256-{digest}'",
    }
    assert "</" not in script and "innerHTML" not in script
    assert SCRIPT not in html and json.loads(data)["recordings"][0] == "s0/r0"


def test_nothing_is_fetched(html):
    page = Page(html)
    assert not {tag for tag, _ in page.tags} & {"link", "iframe", "object", "img", "audio"}
    sources = {a[key] for _, a in page.tags for key in ("src", "href") if key in a}
    assert sources == {"../../embedding.html"}
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", html)


def test_it_says_what_is_heard_and_from_where(html):
    said = " ".join(Page(html).words)
    assert "2 of 32 recordings can be heard" in said
    assert f"Packed & {SCRIPT}." in said and "simulated" in said
    assert f"Which things are the same, and {SCRIPT}." in said


def test_it_can_be_used_without_a_mouse(html):
    page = Page(html)
    (picture,) = (a for t, a in page.tags if t == "svg")
    assert picture["tabindex"] == "0" and picture["role"] == "listbox" and picture["aria-label"]
    labelled = html.count("<label>")
    assert labelled == sum(t in ("select", "input") for t, _ in page.tags) == 4
    assert html.count('aria-live="polite"') == 2 and "noscript" in {t for t, _ in page.tags}


def test_the_same_content_gives_the_same_page(html):
    assert render_interactive(sample(), CLIPS, f"Packed & {SCRIPT}.") == html


def test_the_script_is_given_every_recording():
    shown = pictures()
    made = content(shown, CLIPS)
    n = len(shown.recording)
    assert made["recordings"] == shown.recording.tolist()
    assert made["training"] == shown.training.astype(int).tolist()
    assert [base64.b64decode(c) for c in made["clips"][:3]] == [*CLIPS.values(), b""]
    assert [s["label"] for s in made["spaces"]][:2] == ["latent · 2-D", "latent · PCA"]
    assert all(len(s["points"]) == n for s in made["spaces"]) and len(made["spaces"]) == 7
    facts = {f["label"]: f["values"] for f in made["facts"]}
    assert list(facts) == ["object", "category", "angle deg", "session id", "grasp id"]
    assert facts["angle deg"][:4] == ["−90", "−84.2", "−78.4", "—"]
    colours = {c["label"]: c for c in made["colours"]}
    assert list(colours) == ["object", "category", "angle deg", "session id"]
    thing = colours["object"]
    assert [thing["legend"][e] for e in thing["entries"]] == shown.columns["object"].tolist()
    assert sorted(thing["legend"]) == sorted(THINGS)
    angle = colours["angle deg"]
    assert angle["range"] == ["−90", "90"] and len(angle["palette"]) == STEPS + 1
    assert angle["entries"][0] == 0 and angle["entries"][-1] == STEPS - 1
    assert angle["palette"][angle["entries"][3]] == MISSING  # the angle of that one is not known
    json.dumps(made, allow_nan=False)


def test_points_keep_their_shape_and_up_is_up():
    at = np.array(placed([[0, 0], [4, 0], [0, 1]]))
    along, up = at[1] - at[0], at[2] - at[0]
    assert along.tolist() == [WIDTH - 2 * MARGIN, 0]
    assert up.tolist() == [0, -along[0] / 4]
    assert at.mean(axis=0)[1] < HEIGHT
    tall = np.array(placed([[0, 0], [0, 1e-300]]))
    assert tall.tolist() == [[WIDTH / 2, HEIGHT - MARGIN], [WIDTH / 2, MARGIN]]
    assert placed([[5, 5], [5, 5]]) == [[WIDTH / 2, HEIGHT / 2]] * 2
    assert placed(np.empty((0, 2))) == []


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=80, derandomize=True, deadline=None)
@given(st.integers(1, 5).flatmap(lambda n: arrays(float, (n, 2), elements=finite)))
def test_any_points_are_placed_within_the_picture(points):
    at = np.array(placed(points))
    assert np.all(at >= MARGIN) and np.all(at <= np.array([WIDTH, HEIGHT]) - MARGIN)


def test_an_embedding_without_pictures_says_why():
    nothing = dataclasses.replace(sample(), pictured=None, skipped={"projections": SCRIPT})
    html = render_interactive(nothing, {}, "")
    assert scripts(html) == [] and f"There is no projections: {SCRIPT}" in Page(html).words
