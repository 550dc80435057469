"""The page on which recordings are seen and heard: whole, escaped, and nothing else can run."""

import base64
import dataclasses
import hashlib
import io
import json
import re

import numpy as np
import pytest
import soundfile
from embedding_samples import SCRIPT, SETTINGS, THINGS, pictures, projections
from html_page import Page
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from worlds import RATE_HZ, tone, write_tone

from ajgdata.pipeline import explorer
from ajgdata.pipeline.explorer import build_explorer, sounds
from ajgdata.report.explorer import (
    HEIGHT,
    MARGIN,
    STEPS,
    WIDTH,
    Explored,
    content,
    placed,
    render_explorer,
)
from ajgdata.report.projections import MISSING
from ajgdata.store.audio import write_pcm24
from ajgdata.store.conversion import BYTES_PER_SECOND, mp3_clip
from ajgdata.store.tables import write_tables
from ajgdata.types import AudioSettings, Recording, Target

COUNT = 12
AUDIO = AudioSettings(sample_rate_hz=RATE_HZ)
MORE = "../../experiments/embedding_projections.html"
ONE = Explored("Things", "simulated", SETTINGS["supervision"], MORE, pictures())
CLIPS = {"s0/r0": b"\xff\xfb sound", "s1/r1": b"<more>"}


@pytest.fixture(scope="module")
def html():
    return render_explorer(ONE, CLIPS, f"Packed & {SCRIPT}.")


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
        "img-src": "'self' file: data:",
        "style-src": "'unsafe-inline'",
        "media-src": "'self' file: data:",
        "script-src": f"'sha256-{digest}'",
    }
    assert "</" not in script and "innerHTML" not in script
    assert SCRIPT not in html and json.loads(data)["recordings"][0] == "s0/r0"


def test_nothing_is_fetched(html):
    page = Page(html)
    assert not {tag for tag, _ in page.tags} & {"link", "iframe", "object", "img", "audio"}
    sources = {a[key] for _, a in page.tags for key in ("src", "href") if key in a}
    assert sources == {MORE}
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
    assert render_explorer(ONE, CLIPS, f"Packed & {SCRIPT}.") == html


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


def test_an_embedding_without_projections_says_why():
    html = render_explorer(ONE._replace(shown=None, skipped=SCRIPT), {}, "")
    assert scripts(html) == [] and f"There are no projections: {SCRIPT}" in Page(html).words


@pytest.fixture
def made(project):
    """Tones called things, with the projections of an embedding; the last is of nothing."""
    target = Target(kind="classification")
    project.declare(
        title=f"Things {SCRIPT}",
        targets={name: target.model_dump() for name in ("object", "category")},
        embeddings={"poses": {**SETTINGS, "probes": {}}},
    )
    things = list(THINGS)
    project.write([
        Recording(
            recording_id=f"r{i:02d}",
            file=f"audio/r{i:02d}.wav",
            sha256=write_tone(project.folder() / "audio" / f"r{i:02d}.wav", 400 + 10 * i),
            grasp_id=f"g{i // 2}",
            sample=i % 2,
            object=things[i % 4],
            labels={"category": THINGS[things[i % 4]]},
        )
        for i in range(COUNT)
    ])  # fmt: skip
    project.shard()
    return project


def stored(path, **about):
    """The first recordings of `pictures`, under the names of those of `made`."""
    recordings, points = projections()
    rows = [{**row, "recording": f"s1/r{i:02d}"} for i, row in enumerate(recordings.rows)]
    n = len(rows)
    places = [row for i, row in enumerate(points.rows) if i % n < COUNT - 1]
    tables = [
        dataclasses.replace(recordings, rows=tuple(rows[: COUNT - 1])),
        dataclasses.replace(points, rows=tuple(places)),
    ]
    skipped = "skipped" in about
    write_tables(path, [] if skipped else tables, provenance={"source": "recorded"}, **about)


def built(project, **about):
    """The page as text."""
    path, page = project.root / "projections.json", project.root / "explorer.html"
    stored(path, **about)
    build_explorer(
        path, dataset="d", embedding="poses", paths=project.paths, page=page,
    )  # fmt: skip
    return page.read_text(encoding="utf-8")


def heard(html):
    return json.loads(re.search(r'id="content">(.*?)</script>', html, flags=re.DOTALL)[1])


def test_every_recording_that_can_be_read_can_be_heard(made):
    (made.folder() / "audio" / "r03.wav").unlink()
    html = built(made)
    content = heard(html)
    assert [bool(clip) for clip in content["clips"]] == [i != 3 for i in range(COUNT - 1)]
    said = " ".join(Page(html).words)
    assert "10 of 11 recordings can be heard" in said and "recorded" in said
    assert f"Things {SCRIPT} · poses" in said
    assert MORE in {a.get("href") for _, a in Page(html).tags}
    assert content["facts"][0]["values"][:4] == list(THINGS)
    assert built(made) == html


def test_of_too_many_recordings_some_are_shown_evenly_and_the_page_says_so(made, monkeypatch):
    whole = heard(built(made))
    monkeypatch.setattr(explorer, "MOST_SHOWN", 6)
    html = built(made)
    some, places = heard(html), [0, 2, 4, 6, 8, 10]
    assert some["recordings"] == [whole["recordings"][i] for i in places]
    for fact, every in zip(some["facts"], whole["facts"], strict=True):
        assert fact["values"] == [every["values"][i] for i in places]
    assert all(len(space["points"]) == 6 for space in some["spaces"])
    assert not any(some["clips"])
    assert "6 of 11 recordings are shown" in " ".join(Page(html).words)
    html = built(made, recordings=11, available=5000)  # the embedding is of some
    assert "6 of 5,000 recordings are shown" in " ".join(Page(html).words)


def test_an_embedding_that_was_not_trained_has_a_page_that_says_why(made):
    said = Page(built(made, skipped="one thing only")).words
    assert "There are no projections: one thing only" in said


def test_one_gain_for_all_and_the_loudest_at_its_peak(made):
    path = made.folder() / "audio" / "r00.wav"
    write_pcm24(path, tone(440) / 10, RATE_HZ)  # a tenth of the others, which reach 0.5
    wanted = {"s1/r00", "s1/r01"}
    clips, told = sounds(made.paths, "d", AUDIO, wanted)
    assert set(clips) == wanted and "(+5 dB)" in told  # 0.9 / 0.5
    quiet, loud = (_level(clips[name]) for name in sorted(wanted))
    # the encoder takes 5 % off, against clipping
    assert loud == pytest.approx(0.95 * 0.9 / 2**0.5, rel=0.02)
    assert quiet == pytest.approx(0.95 * 0.09 / 2**0.5, rel=0.02)


def _level(clip: bytes) -> float:
    """Of the middle: the encoder puts some 1100 samples of silence before the sound."""
    samples, _ = soundfile.read(io.BytesIO(clip))
    return float(np.sqrt(np.mean(samples[1500:2750] ** 2)))


def test_more_recordings_are_shorter_and_too_many_are_silent(made, monkeypatch):
    wanted = {f"s1/r{i:02d}" for i in range(COUNT)}
    for seconds, shown in ((0.2, "at most 0.2 s"), (9, "at most 3.0 s")):
        room_mb = seconds * BYTES_PER_SECOND * COUNT * 4 / 3 / 1e6
        monkeypatch.setattr(explorer, "MOST_SOUND_MB", 1.001 * room_mb)
        clips, told = sounds(made.paths, "d", AUDIO, wanted)
        assert shown in told and len(clips) == COUNT
    monkeypatch.setattr(explorer, "MOST_SOUND_MB", room_mb / 100)
    clips, told = sounds(made.paths, "d", AUDIO, wanted)
    assert clips == {} and "12 recordings are too many" in told
    assert sounds(made.paths, "d", AUDIO, set())[0] == {}


@pytest.mark.parametrize(("rate", "packed"), [(8_000, 8_000), (44_100, 44_100), (96_000, 44_100)])
def test_a_clip_keeps_pitch_and_level_at_any_rate(rate, packed):
    time = np.arange(rate) / rate
    clip = mp3_clip(0.25 * np.sin(2 * np.pi * 1000 * time), rate, gain=2)
    assert clip == mp3_clip(0.25 * np.sin(2 * np.pi * 1000 * time), rate, gain=2)
    samples, found = soundfile.read(io.BytesIO(clip))
    assert found == packed
    middle = samples[packed // 4 : 3 * packed // 4]
    spectrum = np.abs(np.fft.rfft(middle))
    assert np.fft.rfftfreq(len(middle), 1 / packed)[spectrum.argmax()] == pytest.approx(1000, abs=2)
    # the encoder takes 5 % off, against clipping
    assert np.sqrt(2 * np.mean(middle**2)) == pytest.approx(0.95 * 0.5, rel=0.02)
    assert len(clip) <= 1.3 * BYTES_PER_SECOND * len(samples) / packed
