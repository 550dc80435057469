"""One grasp of a run -> the opening picture, and its content in words and numbers."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.acquire.recipe import session_names
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.gripper import Scene, build_plan
from ajgdata.gripper.medium import Air
from ajgdata.gripper.pressure_frames import PressureFrames, pressure_frames, ricker_wavelet
from ajgdata.paths import Paths
from ajgdata.pipeline.planned_grasps import planned_grasps
from ajgdata.store.audio import read_audio
from ajgdata.store.features import FeatureRows, read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.sessions import inside, read_dataset, read_session
from ajgdata.store.tables import read_measurements
from ajgdata.types import (
    AudioSettings,
    DataError,
    FeatureSettings,
    NotPossibleError,
)
from ajgdata.types.registry import model_label

if TYPE_CHECKING:
    from ajgdata.report.opening import Opening

#: Grid and pulse of the field: finer than that of recordings, so that the wave is seen, not cells.
FIELD_MM, PULSE_HZ, FRAME_S = 1.6, 10_000.0, 1e-5
#: The first moment, as a share of the time that sound takes to the object.
LEAVING = 0.33
LOWEST_DB = -120.0


def build_opening(paths: Paths, *, store: Path, tables: Path, audio: AudioSettings) -> None:
    """Draw the opening picture of a task, and write its text (JSON) to the same folder.

    `tables` are those of SHOWN_RESULT. The JSON contains `alt` for people and the
    `recording` that is shown. If nothing can be shown, it contains `skipped`, the reason, and there
    is no picture.
    """
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.opening import alt_text, opening_figure

    try:
        opening = _opening(paths, read_store(store), tables, audio)
    except NotPossibleError as error:
        about = {"skipped": str(error)}
    else:
        # PNG for README
        save_figure(opening_figure(opening), paths.opening.with_suffix(""), ("svg", "pdf", "png"))
        about = {"alt": alt_text(opening), "recording": opening.recording}
    write_bytes(paths.opening, json_bytes(about))


def _opening(paths: Paths, shard: FeatureRows, tables: Path, audio: AudioSettings) -> Opening:
    """Return the picture's content. Raises NotPossibleError if nothing can be shown.

    It is a recording of the smallest sphere, because every section through it is a circle, or of
    the smallest object if there is no sphere.
    """
    from ajgdata.report.opening import Opening

    about, results = read_measurements(tables)[0]
    if "skipped" in about:
        raise NotPossibleError(about["skipped"])
    setups = _planned_setups(paths, about["dataset"])
    digest_of = _by_recording(shard, "setup_sha256")
    part = part_columns(GROUPED, about["dataset"])
    predictions = next(t for t in results if t.name == "predictions").where(**part._asdict())
    predicted = [row for row in predictions.rows if digest_of.get(row["recording"]) in setups]
    scenes = {row["y_true"]: setups[digest_of[row["recording"]]] for row in predicted}
    if not scenes:
        raise NotPossibleError("no recording of a simulated grasp was predicted")
    name = _smallest(scenes)
    prediction = _typical([row for row in predicted if row["y_true"] == name])
    recording = prediction["recording"]
    scene = Scene.model_validate(setups[digest_of[recording]])
    session = _by_recording(shard, "session_id")[recording]
    row = shard.columns["recording"].values.tolist().index(recording)
    return Opening(
        recording=recording,
        object=name,
        scene=scene,
        film=field_of(scene),
        sweep=_sweep(paths.session(about["dataset"], session), audio),
        sample_rate_hz=audio.sample_rate_hz,
        frequency_hz=shard.frequency_hz,
        level_db=_level_db(shard, row),
        model=model_label(about["model"], about["kind"]),
        predicted=prediction["y_pred"],
        probability=prediction["probability"],
    )


def _smallest(scenes: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the name of the smallest sphere, or else of the smallest object, of scenes by name."""
    held = {name: Scene.model_validate(scene).object for name, scene in scenes.items()}
    sizes = {n: (shape.kind != "sphere", max(shape.size_mm)) for n, shape in held.items() if shape}
    return min(sizes, key=lambda n: sizes[n])


def _planned_setups(paths: Paths, dataset: str) -> dict[str, Mapping[str, Any]]:
    """Return the scenes of objects that the recipe of a data set plans, by their digests."""
    spec = read_dataset(paths, dataset)
    sessions = session_names(spec.recipe)
    planned = planned_grasps(paths.dataset(dataset), spec, sessions) if sessions else []
    return {g.digest: g.setup for grasps in planned for g in grasps if g.object}


def _by_recording(shard: FeatureRows, column: str) -> dict[str, str]:
    """Return a column of the feature file by the name of the recording."""
    names, values = (shard.columns[key].values.tolist() for key in ("recording", column))
    return dict(zip(names, values, strict=True))


def _typical(predictions: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the prediction with the median probability of all correct ones, or else of all."""
    correct = [row for row in predictions if row["y_pred"] == row["y_true"]]
    ordered = sorted(correct or predictions, key=lambda row: (row["probability"], row["recording"]))
    return ordered[(len(ordered) - 1) // 2]


def field_of(scene: Scene) -> PressureFrames:
    """Return the pressure of a short pulse in the plane xz at three moments.

    Their times count from when the pulse leaves: on its way, when sound in air is at the highest
    point of what it meets, and when it is back at the microphone. The grid is FIELD_MM.
    """
    from ajgdata.report.scenes import section

    cut, gripper = section(scene), scene.gripper
    touching = np.where(cut.inside, cut.floor, -np.inf)
    under = int(np.argmax(touching)) if cut.inside.any() else int(np.argmin(cut.floor))
    at = np.array([cut.x[under], cut.floor[under]])
    ways = [
        float(np.hypot(*(at - [across, gripper.height_mm])))
        for across in (gripper.speaker_mm[0], gripper.microphone_mm[0])
    ]
    there, back = np.array(ways) / 1e3 / Air(scene.environment.temperature_c).sound_speed
    moments_s = np.array([LEAVING * there, there, there + back])
    fine = scene.numerics.model_copy(update={"dx_mm": FIELD_MM})
    plan = build_plan(scene.model_copy(update={"numerics": fine}))
    dt = plan.system.dt
    leaves_s = len(ricker_wavelet(dt, PULSE_HZ)) // 2 * dt
    every = max(1, round(FRAME_S / dt))
    frames = int(np.ceil((leaves_s + moments_s[-1]) / (every * dt)))
    film = pressure_frames(plan, every, frames, PULSE_HZ)
    shown = [int(np.argmin(np.abs(film.times_s - leaves_s - moment))) for moment in moments_s]
    times_s = film.times_s[shown] - leaves_s
    return dataclasses.replace(film, times_s=times_s, frames=film.frames[shown])


def _sweep(folder: Path, audio: AudioSettings) -> np.ndarray:
    """Return what the session in `folder` played, (samples,), or raise NotPossibleError."""
    try:
        if played := read_session(folder).excitation:
            return read_audio(inside(folder, played.file), audio).samples
    except DataError:
        pass
    raise NotPossibleError(f"session {folder.name} lacks the sound that it played")


def _level_db(shard: FeatureRows, row: int) -> np.ndarray:
    """Return the feature of a row (bins,) in dB of its largest bin."""
    quantity = FeatureSettings(**json.loads(str(shard.attrs["settings"]))["features"]).quantity
    feature = np.asarray(shard.feature[row], float)
    factor = 10 if quantity == "power" else 20
    least = 10 ** (LOWEST_DB / factor)
    return factor * np.log10(np.maximum(feature / (feature.max() or 1), least))
