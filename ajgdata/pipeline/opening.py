"""One grasp of a run -> the opening picture, and what it shows in words and numbers.

Light: Snakemake imports it to choose the task.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments import asked_of
from ajgdata.experiments.cross_validation_results import GROUPED, PAPER_MODEL
from ajgdata.paths import Paths
from ajgdata.pipeline.recipes import planned_grasps
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.store.sessions import read_dataset, read_session
from ajgdata.store.tables import plain, read_tables
from ajgdata.types import (
    CROSS_VALIDATION,
    AudioSettings,
    DataError,
    DatasetSpec,
    FeatureSettings,
    NotPossibleError,
)

if TYPE_CHECKING:
    from ajgdata.acquire.recipe import Grasp
    from ajgdata.gripper import Scene
    from ajgdata.gripper.simulation import Film
    from ajgdata.report.opening import Opening
    from ajgdata.store.features import Shard
    from ajgdata.types.table import Table

#: Classes that are objects are what a picture can show.
OBJECT = "object"
#: Grid and pulse of the field: finer than that of recordings, so that the wave is seen, not cells.
FIELD_MM, PULSE_HZ, FRAME_S = 1.6, 10_000.0, 1e-5
#: The first moment, as a share of the time that sound takes to the object.
LEAVING = 0.33
SILENT_DB = -120.0


class Subject(NamedTuple):
    """The task whose recording is shown, and its jobs of cross-validation, the paper's first."""

    dataset: str
    task: str
    kinds: tuple[str, ...]


def subject_of(specs: Mapping[str, DatasetSpec]) -> Subject | None:
    """Return the task that tells objects, made by the virtual gripper, of the most kinds of shape.

    None where a run has none: recordings of a real gripper are not put into a picture of a
    simulated one.
    """
    found = []
    for name, spec in specs.items():
        if spec.recipe is None:
            continue
        for task in (t for t in spec.tasks if spec.tasks[t].target == OBJECT):
            asked = [a for a in asked_of(spec, task) if a.experiment.name == CROSS_VALIDATION]
            kinds = [kind for one in asked for kind in one.kinds]
            if kinds:
                first = f"{CROSS_VALIDATION}-{PAPER_MODEL}"
                ordered = tuple(sorted(kinds, key=lambda kind: kind != first))
                found.append((_kinds_of_shape(spec), Subject(name, task, ordered)))
    return max(found, key=lambda one: one[0], default=(0, None))[1]


def _kinds_of_shape(spec: DatasetSpec) -> int:
    from ajgdata.gripper.object_library import OBJECTS

    shapes = [one.shape for one in spec.recipe.objects] if spec.recipe else []
    named = (OBJECTS[s].shape.kind if isinstance(s, str) else str(s.get("kind")) for s in shapes)
    return len(set(named))


def build_opening(
    paths: Paths,
    *,
    store: Path,
    tables: Sequence[Path],
    audio: AudioSettings,
    code: str,
) -> None:
    """Draw the opening picture of a task, and write what it shows (JSON) beside it.

    `tables` are of the task's cross-validations; the first with probabilities counts. The JSON
    holds `alt` and `text` for people, what is shown (`dataset`, `task`, `object`, `grasp`,
    `recording`, `model`, `fold`, `probability`, `moments_ms`, `grid_mm`), and what made it. If
    nothing can be shown, it holds `skipped`, the reason, and there is no picture.
    """
    from ajgdata.report.canvas import save_figure
    from ajgdata.report.opening import opening_caption, opening_figure
    from ajgdata.store.features import read_store
    from ajgdata.store.provenance import software

    made = {**software(), "code": code}
    try:
        shown, facts = _opening(paths, read_store(store), tables, audio)
    except NotPossibleError as error:
        write_bytes(paths.opening, json_bytes({"skipped": str(error), **made}))
        return
    save_figure(opening_figure(shown), paths.opening.with_suffix(""))
    about = {**opening_caption(shown)._asdict(), **facts}
    write_bytes(paths.opening, json_bytes(plain({**about, **made})))


def _opening(
    paths: Paths, shard: Shard, tables: Sequence[Path], audio: AudioSettings
) -> tuple[Opening, dict[str, Any]]:
    """Return the picture's content, and facts about it.

    Raises NotPossibleError if nothing can be shown.
    """
    from ajgdata.gripper import Scene
    from ajgdata.models import model_label
    from ajgdata.report.format import words
    from ajgdata.report.opening import Decision, Opening

    about, predictions = _predictions(tables)
    grasps = _planned(paths, about["dataset"])
    digests = shard.columns.get("setup_sha256")
    known = [] if digests is None else [d for d in digests.values.tolist() if d in grasps]
    if digests is None or not known:
        raise NotPossibleError("no recording of a simulated grasp can be used")
    name = _shown_object({grasps[d].object: grasps[d].setup for d in known})
    row = _typical(shard, name, predictions)
    scene = Scene.model_validate(grasps[str(digests.values[row])].setup)
    recording, grasp, session = (
        str(shard.columns[key].values[row]) for key in ("recording", "grasp_id", "session_id")
    )
    decision, prediction = None, dict[str, Any]()
    if predictions is not None:
        result = predictions.where(recording=recording).rows[0]
        prediction = {"model": about["model"]}
        prediction |= {key: result[key] for key in ("fold", "probability")}
        label = model_label(about["model"], about["kind"])
        decision = Decision(label, result["y_pred"], result["probability"], result["y_true"])
    film, moments_ms = field_of(scene)
    shown = Opening(
        object=words(name),
        scene=scene,
        film=film,
        moments_ms=moments_ms,
        sweep=_sweep(paths.session(about["dataset"], session), audio),
        sample_rate_hz=audio.sample_rate_hz,
        frequency_hz=shard.frequency_hz,
        level_db=_level_db(shard, row),
        decision=decision,
    )
    facts = {"dataset": about["dataset"], "task": about["task"], "object": name, "grasp": grasp}
    facts |= {"recording": recording, "moments_ms": moments_ms, "grid_mm": FIELD_MM, **prediction}
    return shown, facts


def _planned(paths: Paths, dataset: str) -> dict[str, Grasp]:
    """Return the grasps of objects that the recipe of a data set plans, by their digests."""
    spec = read_dataset(paths, dataset)
    sessions = session_names(spec.recipe) if spec.recipe else []
    planned = planned_grasps(paths.dataset(dataset), spec, sessions) if sessions else []
    return {one.digest: one for grasps in planned for one in grasps if one.object}


def _predictions(tables: Sequence[Path]) -> tuple[Mapping[str, Any], Table | None]:
    """Return the first result with probabilities of held-out recordings; else None of the first."""
    read = [read_tables(file) for file in tables]
    for about, some in read:
        for table in (one.where(split=GROUPED) for one in some if one.name == "predictions"):
            if table.rows and np.isfinite(table.numbers("probability")).all():
                return about, table
    return read[0][0], None


def _shown_object(setups: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the smallest sphere, which every section through it shows as it is; else the first."""
    from ajgdata.gripper import Scene

    objects = {name: Scene.model_validate(setup).object for name, setup in setups.items()}
    spheres = {n: max(o.size_mm) for n, o in objects.items() if o and o.kind == "sphere"}
    return min(spheres, key=lambda name: spheres[name]) if spheres else next(iter(objects))


def _typical(shard: Shard, name: str, predictions: Table | None) -> int:
    """Return the row of the object's recording with the median probability of all correct ones.

    If no prediction is correct, return the median of all; without predictions the first.
    """
    own = np.flatnonzero(shard.columns[OBJECT].values == name)
    row_of = dict(zip(shard.columns["recording"].values[own].tolist(), own.tolist(), strict=True))
    rows = [r for r in (predictions.rows if predictions else ()) if r["recording"] in row_of]
    rows = [row for row in rows if row["y_pred"] == name] or rows
    ordered = sorted(rows, key=lambda row: (row["probability"], row["recording"]))
    return row_of[ordered[(len(ordered) - 1) // 2]["recording"]] if ordered else int(own[0])


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
    from ajgdata.pipeline.recordings import read_excitation
    from ajgdata.store.session_audio import played_sound

    try:
        samples, _ = read_excitation(folder.name, played_sound(folder, read_session(folder)), audio)
    except DataError:
        samples = None
    if samples is None:
        raise NotPossibleError(f"session {folder.name} lacks the sound that it played")
    return samples


def _level_db(shard: Shard, row: int) -> np.ndarray:
    """Return the feature of a row (bins,) in dB of its largest bin."""
    quantity = FeatureSettings(**json.loads(str(shard.attrs["settings"]))["features"]).quantity
    feature = np.asarray(shard.feature[row], float)
    factor = 10 if quantity == "power" else 20
    least = 10 ** (SILENT_DB / factor)
    return factor * np.log10(np.maximum(feature / (feature.max() or 1), least))
