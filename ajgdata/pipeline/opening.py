"""Opening picture of the report: one simulated grasp, its sound field and its prediction."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ajgdata.acquire.recipe import session_names
from ajgdata.evaluate.parts import GROUPED, part_columns
from ajgdata.experiments.scores import PREDICTIONS
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
from ajgdata.types import AudioSettings, DataError, FeatureSettings, NotPossibleError
from ajgdata.types.features import feature_settings
from ajgdata.types.registry import model_label

if TYPE_CHECKING:
    from ajgdata.report.opening import Opening

#: Grid of the sound field: finer than that of recordings, so the picture shows waves, not cells.
FIELD_MM = 1.6
#: Frequency at which the spectrum of the pulse has its maximum.
PULSE_HZ = 10_000.0
#: Time between two frames of the simulated field.
FRAME_S = 1e-5
#: First drawn moment, as a share of the time that sound takes from the speaker to the object.
LEAVING = 0.33
#: Lowest drawn level of the spectrum, relative to its largest bin.
LOWEST_DB = -120.0


def build_opening(paths: Paths, *, store: Path, tables: Path, audio: AudioSettings) -> None:
    """Draw the opening picture of a task, and write its text (JSON) to the same folder.

    `store` is the feature file of the data set, and `tables` the measurement SHOWN_RESULT of the
    task. The JSON contains `alt`, a description in words, and the shown `recording`. If nothing can
    be shown, it contains only `skipped`, the reason, and no picture is drawn.
    """
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.opening import alt_text, opening_figure

    try:
        opening = _opening(paths, read_store(store), tables, audio)
    except NotPossibleError as error:
        about = {"skipped": str(error)}
    else:
        # The README shows the PNG.
        save_figure(opening_figure(opening), paths.opening.with_suffix(""), ("svg", "pdf", "png"))
        about = {"alt": alt_text(opening), "recording": opening.recording}
    write_bytes(paths.opening, json_bytes(about))


def _opening(paths: Paths, features: FeatureRows, tables: Path, audio: AudioSettings) -> Opening:
    """Return the content of the picture. Raises NotPossibleError if nothing can be shown.

    The picture shows a recording of the smallest sphere, because every vertical section through its
    centre is the same circle. Without a sphere, it shows the smallest object.
    """
    from ajgdata.report.opening import Opening

    about, results = read_measurements(tables)[0]
    if "skipped" in about:
        raise NotPossibleError(about["skipped"])
    dataset = about["dataset"]
    setups = _planned_setups(paths, dataset)
    digests = _by_recording(features, "setup_sha256")
    all_predictions = next(table for table in results if table.name == PREDICTIONS)
    held_out = all_predictions.where(**part_columns(GROUPED, dataset)._asdict()).rows
    predictions = [row for row in held_out if digests.get(row["recording"]) in setups]
    if not predictions:
        raise NotPossibleError("no recording of a simulated grasp was predicted")

    scenes = {row["y_true"]: setups[digests[row["recording"]]] for row in predictions}
    name = _smallest(scenes)
    prediction = _typical([row for row in predictions if row["y_true"] == name])
    recording = prediction["recording"]
    scene = Scene.model_validate(setups[digests[recording]])
    session = _by_recording(features, "session_id")[recording]
    row = features.columns["recording"].values.tolist().index(recording)
    return Opening(
        recording=recording,
        object=name,
        scene=scene,
        film=sound_field(scene),
        sweep=_sweep(paths.session(dataset, session), audio),
        sample_rate_hz=audio.sample_rate_hz,
        frequency_hz=features.frequency_hz,
        level_db=_level_db(features, row),
        model=model_label(about["model"], about["kind"]),
        predicted=prediction["y_pred"],
        probability=prediction["probability"],
    )


def _planned_setups(paths: Paths, dataset: str) -> dict[str, Mapping[str, Any]]:
    """Return the scenes of objects that the recipe of a data set plans, by their digests."""
    spec = read_dataset(paths, dataset)
    sessions = session_names(spec.recipe)
    if not sessions:
        return {}
    planned = planned_grasps(paths.dataset(dataset), spec, sessions)
    return {grasp.digest: grasp.setup for grasps in planned for grasp in grasps if grasp.object}


def _by_recording(features: FeatureRows, column: str) -> dict[str, str]:
    """Return a column of the feature file by the name of the recording."""
    names = features.columns["recording"].values.tolist()
    values = features.columns[column].values.tolist()
    return dict(zip(names, values, strict=True))


def _smallest(scenes: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the name of the smallest sphere of scenes by object, or else of the smallest object.

    The size of an object is its largest dimension.
    """
    order = {}
    for name, scene in scenes.items():
        shape = Scene.model_validate(scene).object
        if shape:
            order[name] = (shape.kind != "sphere", max(shape.size_mm))
    return min(order, key=lambda name: order[name])


def _typical(predictions: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the prediction with the median probability of all correct ones, or else of all."""
    correct = [row for row in predictions if row["y_pred"] == row["y_true"]]
    ordered = sorted(correct or predictions, key=lambda row: (row["probability"], row["recording"]))
    return ordered[(len(ordered) - 1) // 2]


def sound_field(scene: Scene) -> PressureFrames:
    """Return the pressure of a short pulse in the plane xz at three moments.

    At the first moment, the pulse is on its way. At the second, sound in air reaches the highest
    point above the object, or the lowest point of an empty cavity. At the third, it is back at the
    microphone. The times count from when the pulse leaves the speaker. The grid is FIELD_MM.
    """
    from ajgdata.report.scenes import section

    cut = section(scene)
    if cut.inside.any():
        point = int(np.argmax(np.where(cut.inside, cut.floor, -np.inf)))
    else:
        point = int(np.argmin(cut.floor))
    target_mm = np.array([cut.x[point], cut.floor[point]])
    gripper = scene.gripper
    ways_mm = [
        float(np.hypot(*(target_mm - [across_mm, gripper.height_mm])))
        for across_mm in (gripper.speaker_mm[0], gripper.microphone_mm[0])
    ]
    there_s, back_s = np.array(ways_mm) / 1e3 / Air(scene.environment.temperature_c).sound_speed
    moments_s = np.array([LEAVING * there_s, there_s, there_s + back_s])

    fine = scene.numerics.model_copy(update={"dx_mm": FIELD_MM})
    plan = build_plan(scene.model_copy(update={"numerics": fine}))
    dt_s = plan.system.dt
    leaves_s = len(ricker_wavelet(dt_s, PULSE_HZ)) // 2 * dt_s  # the middle of the pulse
    every = max(1, round(FRAME_S / dt_s))
    frames = int(np.ceil((leaves_s + moments_s[-1]) / (every * dt_s)))
    film = pressure_frames(plan, every, frames, PULSE_HZ)
    shown = [int(np.argmin(np.abs(film.times_s - leaves_s - moment))) for moment in moments_s]
    times_s = film.times_s[shown] - leaves_s
    return dataclasses.replace(film, times_s=times_s, frames=film.frames[shown])


def _sweep(folder: Path, audio: AudioSettings) -> np.ndarray:
    """Return the sound (samples,) that a session played. Raises NotPossibleError if it is missing.

    `folder` is that of the session.
    """
    try:
        played = read_session(folder).excitation
        if played:
            return read_audio(inside(folder, played.file), audio).samples
    except DataError:
        pass
    raise NotPossibleError(f"session {folder.name} lacks the sound that it played")


def _level_db(features: FeatureRows, row: int) -> np.ndarray:
    """Return the feature (bins,) of a row in dB relative to its largest bin."""
    about = feature_settings(features.settings["features"])
    if not (isinstance(about, FeatureSettings) and features.has_bins_only):
        raise NotPossibleError("the features are not spectra of one microphone")
    feature = np.asarray(features.feature[row], float)
    factor = 10 if about.is_power else 20
    least = 10 ** (LOWEST_DB / factor)
    return factor * np.log10(np.maximum(feature / (feature.max() or 1), least))
