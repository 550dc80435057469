"""One grasp of a run -> the opening picture, and its content in words and numbers.

Light: Snakemake imports it to choose the task.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments.cross_validation_results import GROUPED, PAPER_MODEL
from ajgdata.paths import Paths
from ajgdata.pipeline.recipes import planned_grasps
from ajgdata.store.audio import read_audio
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.sessions import inside, read_dataset, read_session
from ajgdata.store.tables import plain, read_tables
from ajgdata.types import (
    CROSS_VALIDATION,
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureSettings,
    NotPossibleError,
    Recipe,
)

if TYPE_CHECKING:
    from ajgdata.acquire.recipe import Grasp
    from ajgdata.gripper import Scene
    from ajgdata.gripper.simulation import Film
    from ajgdata.report.opening import Opening
    from ajgdata.store.features import Shard
    from ajgdata.types.table import Table

#: Target whose classes a picture can show.
OBJECT = "object"
#: Experiment whose predictions are shown.
KIND = f"{CROSS_VALIDATION}-{PAPER_MODEL}"
#: Grid and pulse of the field: finer than that of recordings, so that the wave is seen, not cells.
FIELD_MM, PULSE_HZ, FRAME_S = 1.6, 10_000.0, 1e-5
#: The first moment, as a share of the time that sound takes to the object.
LEAVING = 0.33
SILENT_DB = -120.0


class Subject(NamedTuple):
    """Data set and task of the recording that is shown."""

    dataset: str
    task: str


def subject_of(specs: Mapping[str, DatasetSpec]) -> Subject | None:
    """Return the simulated task on objects with the most kinds of shape, if the paper's model is
    evaluated on it; None if there is no such task."""
    subjects = {
        Subject(name, task): _shape_kinds(spec.recipe)
        for name, spec in specs.items()
        if spec.recipe
        for task, settings in spec.tasks.items()
        if settings.target == OBJECT and PAPER_MODEL in settings.models
    }
    return max(subjects, key=subjects.__getitem__, default=None)


def _shape_kinds(recipe: Recipe) -> int:
    from ajgdata.gripper.object_library import OBJECTS

    shapes = [one.shape for one in recipe.objects]
    return len({OBJECTS[s].shape.kind if isinstance(s, str) else s.get("kind") for s in shapes})


def build_opening(
    paths: Paths, *, store: Path, tables: Path, audio: AudioSettings, code: str
) -> None:
    """Draw the opening picture of a task, and write its content (JSON) to the same folder.

    `tables` are those of the experiment KIND. The JSON contains `alt` for people, what is shown
    (`dataset`, `task`, `object`, `grasp`, `recording`, `model`, `fold`, `probability`,
    `moments_ms`, `grid_mm`), and software. If nothing can be shown, it contains `skipped`, the
    reason, and there is no picture.
    """
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.opening import alt_text, opening_figure
    from ajgdata.store.features import read_store
    from ajgdata.store.provenance import software

    try:
        opening, facts = _opening(paths, read_store(store), tables, audio)
    except NotPossibleError as error:
        about: dict[str, Any] = {"skipped": str(error)}
    else:
        save_figure(opening_figure(opening), paths.opening.with_suffix(""))
        about = {"alt": alt_text(opening), **facts}
    write_bytes(paths.opening, json_bytes(plain({**about, **software(), "code": code})))


def _opening(
    paths: Paths, shard: Shard, tables: Path, audio: AudioSettings
) -> tuple[Opening, dict[str, Any]]:
    """Return the picture's content, and facts about it.

    Raises NotPossibleError if nothing can be shown.
    """
    from ajgdata.gripper import Scene
    from ajgdata.models import model_label
    from ajgdata.report.format import words
    from ajgdata.report.opening import Decision, Opening

    about, results = read_tables(tables)
    if "skipped" in about:
        raise NotPossibleError(about["skipped"])
    grasps = _planned(paths, about["dataset"])
    digests = shard.columns["setup_sha256"].values
    simulated = [grasps[digest] for digest in digests.tolist() if digest in grasps]
    if not simulated:
        raise NotPossibleError("no recording of a simulated grasp can be used")
    name = _shown_object({grasp.object: grasp.setup for grasp in simulated})
    predictions = next(t for t in results if t.name == "predictions").where(split=GROUPED)
    row, prediction = _typical(shard, name, predictions)
    scene = Scene.model_validate(grasps[str(digests[row])].setup)
    grasp, session = (str(shard.columns[key].values[row]) for key in ("grasp_id", "session_id"))
    film, moments_ms = field_of(scene)
    opening = Opening(
        object=words(name),
        scene=scene,
        film=film,
        moments_ms=moments_ms,
        sweep=_sweep(paths.session(about["dataset"], session), audio),
        sample_rate_hz=audio.sample_rate_hz,
        frequency_hz=shard.frequency_hz,
        level_db=_level_db(shard, row),
        decision=Decision(
            model_label(about["model"], about["kind"]),
            *(prediction[key] for key in ("y_pred", "probability", "y_true")),
        ),
    )
    facts = {key: about[key] for key in ("dataset", "task", "model")}
    facts |= {key: prediction[key] for key in ("recording", "fold", "probability")}
    facts |= {"object": name, "grasp": grasp, "moments_ms": moments_ms, "grid_mm": FIELD_MM}
    return opening, facts


def _planned(paths: Paths, dataset: str) -> dict[str, Grasp]:
    """Return the grasps of objects that the recipe of a data set plans, by their digests."""
    spec = read_dataset(paths, dataset)
    sessions = session_names(spec.recipe) if spec.recipe else []
    planned = planned_grasps(paths.dataset(dataset), spec, sessions) if sessions else []
    return {grasp.digest: grasp for grasps in planned for grasp in grasps if grasp.object}


def _shown_object(setups: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the smallest sphere, because every section through it is a circle; else the first."""
    from ajgdata.gripper import Scene

    objects = {name: Scene.model_validate(setup).object for name, setup in setups.items()}
    spheres = {n: max(o.size_mm) for n, o in objects.items() if o and o.kind == "sphere"}
    return min(spheres, key=lambda name: spheres[name]) if spheres else next(iter(objects))


def _typical(shard: Shard, name: str, predictions: Table) -> tuple[int, Mapping[str, Any]]:
    """Return the row of the object's recording with the median probability, and its prediction.

    The median is that of all correct predictions; if there are none, of all. Raises
    NotPossibleError if no recording of the object was predicted.
    """
    own = np.flatnonzero(shard.columns[OBJECT].values == name)
    row_of = dict(zip(shard.columns["recording"].values[own].tolist(), own.tolist(), strict=True))
    rows = [row for row in predictions.rows if row["recording"] in row_of]
    rows = [row for row in rows if row["y_pred"] == name] or rows
    if not rows:
        raise NotPossibleError(f"no recording of {name} was predicted")
    ordered = sorted(rows, key=lambda row: (row["probability"], row["recording"]))
    median = ordered[(len(ordered) - 1) // 2]
    return row_of[median["recording"]], median


def field_of(scene: Scene) -> tuple[Film, tuple[float, ...]]:
    """Return the pressure of a short pulse in the plane xz at three moments, and these in ms.

    They count from when the pulse leaves: on its way, when sound in air is at the highest point of
    what it meets, and when it is back at the microphone. The grid is FIELD_MM.
    """
    from ajgdata.gripper import build_plan
    from ajgdata.gripper.medium import Air
    from ajgdata.gripper.simulation import ricker_wavelet, slices
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
    film = slices(plan, every, frames, PULSE_HZ)
    shown = [int(np.argmin(np.abs(film.times_s - leaves_s - moment))) for moment in moments_s]
    kept = dataclasses.replace(film, times_s=film.times_s[shown], frames=film.frames[shown])
    return kept, tuple(round(1e3 * float(t - leaves_s), 3) for t in kept.times_s)


def _sweep(folder: Path, audio: AudioSettings) -> np.ndarray:
    """Return what the session in `folder` played, (samples,), or raise NotPossibleError."""
    try:
        if played := read_session(folder).excitation:
            return read_audio(inside(folder, played.file), audio).samples
    except DataError:
        pass
    raise NotPossibleError(f"session {folder.name} lacks the sound that it played")


def _level_db(shard: Shard, row: int) -> np.ndarray:
    """Return the feature of a row (bins,) in dB of its largest bin."""
    quantity = FeatureSettings(**json.loads(str(shard.attrs["settings"]))["features"]).quantity
    feature = np.asarray(shard.feature[row], float)
    factor = 10 if quantity == "power" else 20
    least = 10 ** (SILENT_DB / factor)
    return factor * np.log10(np.maximum(feature / (feature.max() or 1), least))
