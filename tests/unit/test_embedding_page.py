"""From latents and documents to the pages on an embedding."""

import dataclasses
import io
import json
import re

import numpy as np
import pytest
import soundfile
from embedding_samples import (
    DIMENSIONS,
    PROVENANCE,
    SCRIPT,
    SETTINGS,
    THINGS,
    declared,
    documents,
    sample,
    transfer,
)
from html_page import Page
from worlds import RATE_HZ, tone, write_tone

from ajgdata.paths import Paths
from ajgdata.pipeline import embed_page
from ajgdata.pipeline.embed_documents import embedded
from ajgdata.pipeline.embed_page import build_embedding_page, build_explorer, sounds
from ajgdata.pipeline.projections import make_projections
from ajgdata.report.embedding_page import figures, render_embeddings
from ajgdata.report.paper import parse_paper
from ajgdata.report.render import Link
from ajgdata.store.audio import write_pcm24
from ajgdata.store.conversion import BYTES_PER_SECOND, mp3_clip
from ajgdata.store.features import Column
from ajgdata.store.files import json_bytes, read_json, write_bytes
from ajgdata.store.latents import Latents, write_latents
from ajgdata.store.report_files import read_paper
from ajgdata.types import AudioSettings, DataError, Embedding, Recording, Target

COUNT = 12
AUDIO = AudioSettings(sample_rate_hz=RATE_HZ)
#: Latents leave the last recording out: it is of nothing.
FOLD = np.arange(COUNT - 1) // 2 % 2
LATENT = {
    d: np.random.default_rng(d).standard_normal((2, 1, COUNT - 1, d)).astype(np.float32)
    for d in DIMENSIONS
}
PAPER = parse_paper(read_paper(Paths()))
CLASS = Target(kind="classification")


@pytest.fixture
def made(project):
    """Tones called things, with latents and all documents."""
    targets = {"object": CLASS, "category": CLASS, "angle_deg": Target(kind="regression")}
    project.declare(
        title=f"Things {SCRIPT}",
        targets={name: target.model_dump() for name, target in targets.items()},
        embeddings={"poses": SETTINGS},
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
            labels={"category": THINGS[things[i % 4]], "angle_deg": str(10 * i)},
        )
        for i in range(COUNT)
    ])  # fmt: skip
    project.shard()
    store, findings = project.merge("s1", targets=targets)
    assert not findings
    columns = {"recording": Column(store.columns["recording"].values[: COUNT - 1])}
    found = Latents(LATENT, FOLD, None, FOLD, columns, PROVENANCE)
    write_latents(project.paths.latents("d", "poses"), found)
    for name, document in documents().items():
        path = project.paths.embedding_document("d", "poses", name)
        write_bytes(path, json_bytes(document))
    return project


def projected(paths):
    make_projections(
        paths.merged("d"),
        paths.latents("d", "poses"),
        settings=Embedding.model_validate(SETTINGS),
        seed=0,
        output=paths.projections("d", "poses"),
    )
    return read_json(paths.projections("d", "poses"))


def test_pictures_are_of_one_run_and_know_their_recordings(made):
    document = projected(made.paths)
    assert document["recording"] == [f"s1/r{i:02d}" for i in range(COUNT - 1)]
    assert document["training"] == (FOLD != 0).tolist()
    assert document["provenance"].items() >= PROVENANCE.items()
    shown = {(p["space"], p["method"]): np.array(p["points"]) for p in document["pictures"]}
    # too few recordings for neighbourhoods: PCA alone, beside the latent of two dimensions
    assert list(shown) == [("latent", "plane"), ("raw", "pca"), ("latent", "pca")]
    np.testing.assert_allclose(shown["latent", "plane"], LATENT[2][0, 0], rtol=1e-6)
    # a plane keeps part of the variance; of training points around their mean
    plane, latent = shown["latent", "pca"], LATENT[4][0, 0]
    assert plane[FOLD != 0].mean(axis=0) == pytest.approx(0, abs=1e-6)
    share = plane[FOLD != 0].var(axis=0).sum() / latent[FOLD != 0].var(axis=0).sum()
    assert 0.5 < share < 1  # the two largest of four variances
    first = made.paths.projections("d", "poses").read_bytes()
    projected(made.paths)
    assert made.paths.projections("d", "poses").read_bytes() == first


def test_latents_of_other_features_are_refused(made):
    paths = made.paths
    columns = {"recording": Column(np.array([f"s9/{i}" for i in range(COUNT - 1)]))}
    write_latents(paths.latents("d", "poses"), Latents(LATENT, FOLD, None, FOLD, columns, {}))
    with pytest.raises(DataError, match="is not of these features; delete it and run again"):
        projected(paths)


def rendered(*shown):
    """A page without its drawings."""
    svgs = dict.fromkeys(figures(shown), b"<svg/>")
    made_by = {"ajgdata_version": "1", "git_commit": "", "code": "c"}
    pages = [Link("gallery.html", "Gallery", "about")]
    return render_embeddings(shown, svgs, PAPER, made_by, {shown[0].id: "latents/d/x.html"}, pages)


def test_the_page_shows_what_was_found_beside_the_paper():
    html = rendered(dataclasses.replace(sample(), title=f"Things {SCRIPT}"))
    assert SCRIPT not in html
    page = Page(html)
    row = page.row(["k-NN gains by the latent"])
    assert any("5 percentage points, or 10 %, higher" in cell for cell in row)
    assert (
        "simulated" in row and "up to 26.6 % higher than raw features, best at 8 dimensions" in row
    )
    assert "up to 26.6 %" in page.row(["k-NN gains by the latent"])[-2]
    assert f"Which things are the same, and {SCRIPT}." in page.words
    assert page.row(["4"])[1:3] == ["55 ± 14 %; 4 s", "50 ± 14 %; 0.03 s"]
    assert page.row(["object", "new grasps of known things"])[3:5] == ["0.25", "0.70 ± 0.14"]
    assert "4 networks in 20 s of one core" in page.words
    links = {a["href"] for t, a in page.tags if t == "a"}
    assert {"latents/d/x.html", "index.html", "gallery.html"} <= links
    assert "embedding/d--poses--by-angle_deg.pdf" in links
    assert not {tag for tag, _ in page.tags} & {"script", "link", "iframe"}
    assert all(a["alt"] and a["src"].startswith("data:") for t, a in page.tags if t == "img")


def test_recorded_things_are_another_experiment_than_the_papers():
    page = Page(rendered(dataclasses.replace(sample(), source="recorded")))
    assert page.row(["k-NN gains by the latent"])[-1] == "—"
    assert "simulated" not in page.row(["categories lie apart"])


def test_the_page_is_built_with_its_files_and_tells_what_was_skipped(made):
    paths = made.paths
    for name in ("distances", "probes", "retrieval"):
        write_bytes(paths.embedding_document("d", "poses", name), b'{"skipped": "one grasp only"}')
    write_bytes(paths.projections("d", "poses"), b'{"skipped": "nothing trained"}')
    build_embedding_page(paths, [("d", "poses")], ["embedding", "gallery"])
    page = Page(paths.page("embedding").read_text(encoding="utf-8"))
    assert "There is no retrieval: one grasp only" in page.words
    assert "There is no projections: nothing trained" in page.words
    files = {f"embedding/{file.name}" for file in paths.page_figures("embedding").iterdir()}
    assert files == {f"embedding/d--poses--neighbours.{suffix}" for suffix in ("svg", "png", "pdf")}
    links = {a["href"] for t, a in page.tags if t == "a"}
    assert files | {"gallery.html"} <= links
    assert not any(link.startswith("latents/") for link in links)
    assert "recorded" in page.words


def test_transfer_stands_alone_and_beside_the_paper():
    spec = declared(base="other", held_out=["tall", SCRIPT])
    read = {"transfer": {"provenance": PROVENANCE, **transfer()}, "transfer_cost": {"cpu_s": 1}}
    one = embedded(spec, "poses", "simulated", read, None)
    html = rendered(one)
    assert SCRIPT not in html
    page = Page(html)
    (told,) = (w for w in page.words if w.startswith("accuracy on unseen grippers with 0 → 4"))
    assert told.endswith("raw features 10 → 50 %, latent across grippers 40 → 80 % (chance 25 %)")
    assert len([t for t, _ in page.tags if t == "img"]) == 2  # probes and transfer


def test_a_figure_that_is_missing_or_shares_a_name_is_refused():
    with pytest.raises(ValueError, match="figures not drawn: d--poses--by-angle_deg"):
        render_embeddings([sample()], {}, {}, {}, {})
    with pytest.raises(ValueError, match="share a file name"):
        figures([sample(), sample()])


# sound


def heard(html):
    return json.loads(re.search(r'id="content">(.*?)</script>', html, flags=re.DOTALL)[1])


def test_every_recording_that_can_be_read_can_be_heard(made):
    paths = made.paths
    projected(paths)
    manifests = [paths.audio_manifest("d", "s1")]
    (made.folder() / "audio" / "r03.wav").unlink()
    build_explorer(paths, "d", "poses", manifests)
    html = paths.explorer("d", "poses").read_text(encoding="utf-8")
    content = heard(html)
    assert [bool(clip) for clip in content["clips"]] == [i != 3 for i in range(COUNT - 1)]
    assert "10 of 11 recordings can be heard" in " ".join(Page(html).words)
    assert content["facts"][0]["values"][:4] == list(THINGS)
    build_explorer(paths, "d", "poses", manifests)
    assert paths.explorer("d", "poses").read_text(encoding="utf-8") == html


def test_one_gain_for_all_and_the_loudest_at_its_peak(made):
    path = made.folder() / "audio" / "r00.wav"
    write_pcm24(path, tone(440) / 10, RATE_HZ)  # a tenth of the others, which reach 0.5
    wanted = {"s1/r00", "s1/r01"}
    clips, told = sounds(made.root, [made.paths.audio_manifest("d", "s1")], AUDIO, wanted)
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
    manifests = [made.paths.audio_manifest("d", "s1")]
    wanted = {f"s1/r{i:02d}" for i in range(COUNT)}
    for seconds, shown in ((0.2, "at most 0.2 s"), (9, "at most 3.0 s")):
        room_mb = seconds * BYTES_PER_SECOND * COUNT * 4 / 3 / 1e6
        monkeypatch.setattr(embed_page, "MOST_SOUND_MB", 1.001 * room_mb)
        clips, told = sounds(made.root, manifests, AUDIO, wanted)
        assert shown in told and len(clips) == COUNT
    monkeypatch.setattr(embed_page, "MOST_SOUND_MB", room_mb / 100)
    clips, told = sounds(made.root, manifests, AUDIO, wanted)
    assert clips == {} and "12 recordings are too many" in told
    assert sounds(made.root, manifests, AUDIO, set())[0] == {}


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
