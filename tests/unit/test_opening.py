"""The opening picture draws one recording's own numbers, over a real scene."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from drawn_figures import texts
from experiment_samples import small_store

from ajgdata.acquire.source import Grasp
from ajgdata.gripper import Scene
from ajgdata.gripper.pressure_slices import Film
from ajgdata.paths import Paths
from ajgdata.pipeline import opening as adapter
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.opening import build_opening, field_of, subject_of
from ajgdata.report.opening import (
    Decision,
    Opening,
    opening_caption,
    opening_figure,
)
from ajgdata.report.scenes import colours_of
from ajgdata.store.audio import write_pcm24
from ajgdata.store.features import text_column, write_store
from ajgdata.store.sessions import list_datasets, read_dataset, write_session
from ajgdata.store.tables import read_tables
from ajgdata.types import AudioSettings, Excitation, Session

PROJECT = Paths(Path(__file__).resolve().parents[2])
SPECS = {name: read_dataset(PROJECT, name) for name in list_datasets(PROJECT)}
AUDIO = AudioSettings()
SHAPES = {
    "ball": {"kind": "sphere", "diameter_mm": 30, "material": "wood"},
    "box": {"kind": "cube", "edge_mm": 20},
    "rod": {"kind": "sphere", "diameter_mm": 40, "material": "wood"},
}


def sweep(seconds=0.2):
    """A logarithmic sweep from 20 Hz to 20 kHz."""
    t = np.arange(round(seconds * AUDIO.sample_rate_hz)) / AUDIO.sample_rate_hz
    rate = np.log(1000) / seconds
    return np.sin(2 * np.pi * 20 / rate * (np.exp(rate * t) - 1))


def film():
    axis = (np.arange(10) - 4.5) * 0.01
    frames = np.random.default_rng(0).normal(size=(3, 10, 10))
    return Film(axis, axis, np.ones((10, 10), bool), np.arange(3.0), frames)


def opening(**changes):
    given = {
        "object": "golf ball", "scene": Scene.model_validate({"object": "golf_ball"}),
        "film": film(), "moments_ms": (0.08, 0.23, 0.45), "sweep": sweep(),
        "sample_rate_hz": AUDIO.sample_rate_hz, "frequency_hz": np.linspace(0, 22_050, 200),
        "level_db": np.linspace(0, -50, 200), "decision": Decision("CNN", "ball", 0.6, "golf_ball"),
    }  # fmt: skip
    return Opening(**(given | changes))


def test_the_picture_shows_the_recordings_own_numbers():
    figure = opening_figure(opening())
    assert {"ball ✗ (golf\nball)", "probability 0.60", "0.08 ms", "0.2 s"} <= set(texts(figure))
    assert {"simulated", "speaker", "microphone"} <= set(texts(figure))
    (line,) = next(axes for axes in figure.axes if axes.get_title() == "spectrum out").lines
    heard = (line.get_xdata() >= 100) & (line.get_xdata() <= 20_000)
    assert heard.all()
    np.testing.assert_allclose(line.get_ydata(), -50 / 22_050 * line.get_xdata(), atol=1e-12)
    fields = [axes.images[0].get_array() for axes in figure.axes if axes.get_xlabel()[-2:] == "ms"]
    np.testing.assert_array_equal(np.array(fields), colours_of(film().frames))
    box, size = figure.get_tightbbox(), figure.get_size_inches()
    assert box.min.min() >= 0 and np.all(box.max <= size)


def test_the_alternative_text_says_what_came_out():
    alt = opening_caption(opening()).alt
    assert alt.startswith("Simulated section of a jamming gripper that holds a golf ball:")
    assert (
        "leaves the speaker (0.08 ms), meets the golf ball (0.23 ms) and comes back (0.45 ms)"
        in alt
    )
    assert alt.endswith("predicts: ball, probability 0.60. It was a golf ball.")
    assert "predicts" not in opening_caption(opening(decision=None)).alt


def test_sound_is_at_the_object_and_at_the_microphone_when_it_is_said_to_be(monkeypatch):
    monkeypatch.setattr(adapter, "FIELD_MM", 3.0)
    scene = Scene.model_validate({"object": "golf_ball"})
    found, moments = field_of(scene)
    assert found.frames.shape[0] == 3 and list(moments) == sorted(moments)
    # 345 m/s: from (-35, 45) mm to the top of the ball, some 22 mm below the rim, and to (34, 45)
    assert moments[1] == pytest.approx(np.hypot(35, 67) / 345, rel=0.05)
    assert moments[2] == pytest.approx((np.hypot(35, 67) + np.hypot(34, 67)) / 345, rel=0.05)

    def loudest(index, x_mm, z_mm):
        near = np.abs(found.across_m - x_mm / 1e3)[None] + np.abs(found.up_m - z_mm / 1e3)[:, None]
        return np.abs(found.frames[index])[near < 8e-3].max() / np.abs(found.frames[0]).max()

    at_object, at_microphone = [[loudest(n, *at) for n in range(3)] for at in ((0, -18), (34, 42))]
    assert at_object[0] < 0.01 < at_object[1]
    assert at_microphone[0] < 0.01 < at_microphone[2]


def test_the_subject_is_the_task_that_tells_objects_of_the_most_shapes():
    kinds = tuple(f"cross_validation-{model}" for model in ("cnn", "linear", "knn"))
    assert subject_of(SPECS) == ("ycb", "object", kinds)
    assert subject_of({"size": SPECS["size"]}) == ("size", "cube", kinds)
    recorded = {name: spec for name, spec in SPECS.items() if spec.recipe is None}
    assert recorded and subject_of(recorded) is None
    assert subject_of({"plate": SPECS["plate"]}) is None  # tells materials


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A store of 60 recordings of balls, boxes and larger balls, and what was told of them."""
    monkeypatch.setattr(adapter, "FIELD_MM", 5.0)
    paths, shard = Paths(tmp_path), small_store()
    objects = shard.columns["object"].values
    grasps = shard.columns["grasp_id"].values
    planned = {
        f"of {g}": Grasp(g, str(o), 1, {}, {"object": SHAPES[o]}, f"of {g}")
        for g, o in dict(zip(grasps.tolist(), objects.tolist(), strict=True)).items()
    }
    monkeypatch.setattr(adapter, "_planned", lambda paths, dataset: planned)
    columns = {
        **shard.columns, "session_id": text_column(["s"] * 60),
        "setup_sha256": text_column([f"of {g}" for g in grasps]),
    }  # fmt: skip
    settings = {"settings": json.dumps({"features": {}})}
    shard = dataclasses.replace(
        shard, columns=columns, frequency_hz=np.linspace(0, 22_050, 60),
        attrs={**shard.attrs, **settings},
    )  # fmt: skip
    write_store(paths.features("d"), shard, {})
    folder = paths.session("d", "s")
    write_pcm24(folder / "played.wav", 0.5 * sweep(), AUDIO.sample_rate_hz)
    played = Excitation(file="played.wav", sha256="")
    write_session(folder, Session(session_id="s", source="virtual", excitation=played), [])
    split = {
        "target": "object", "kind": "classification", "unit": "", "groups": "grasp_id",
        "classes": [], "folds": 5, "withhold": [], "period_deg": None,
    }  # fmt: skip
    run_experiment(
        paths.features("d"), kind="cross_validation-linear", dataset="d", task="t", settings={},
        split=split, others=[], audio=AUDIO, features=SPECS["ycb"].features, paths=paths,
        seed=3, tables=paths.experiment("d", "t", "cross_validation-linear"),
        cost=tmp_path / "cost.json",
    )  # fmt: skip
    return paths


def build(paths):
    build_opening(
        paths, store=paths.features("d"),
        tables=[paths.experiment("d", "t", "cross_validation-linear")],
        audio=AUDIO, code="c",
    )  # fmt: skip
    return json.loads(paths.opening.read_text())


def test_a_typical_held_out_decision_on_the_smallest_sphere_is_shown(project):
    told = build(project)
    _, tables = read_tables(project.experiment("d", "t", "cross_validation-linear"))
    rows = {t.name: t for t in tables}["predictions"].where(split="grouped", y_true="ball").rows
    right = sorted(row["probability"] for row in rows if row["y_pred"] == "ball")
    (shown,) = [row for row in rows if row["recording"] == told["recording"]]
    assert shown["probability"] == right[(len(right) - 1) // 2]
    assert (told["probability"], told["fold"]) == (shown["probability"], shown["fold"])
    kept = ("dataset", "task", "object", "model", "code")
    assert [told[key] for key in kept] == ["d", "t", "ball", "linear", "c"]
    content = project.opening.with_name("opening.svg").read_bytes()
    assert len(content) < 250_000 and b"<svg" in content


def test_where_nothing_can_be_shown_the_reason_is_written_and_no_picture(project, monkeypatch):
    monkeypatch.setattr(adapter, "_planned", lambda paths, dataset: {})
    told = build(project)
    assert told["skipped"] == "no recording of a simulated grasp can be used"
    assert [path.name for path in project.opening.parent.iterdir()] == ["opening.json"]
