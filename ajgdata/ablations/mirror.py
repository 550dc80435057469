"""Orientation: a gripper that is its own mirror image cannot tell an angle from its image.

Speaker s and microphone m on a round roof have a mirror plane at the angle a of least misfit: the
mirror maps s to s and m to m, or s to m and m to s, which by reciprocity sounds the same. A bar at
θ then sounds like one at 2a - θ: cos 2(θ - a) can be read, sin 2(θ - a) cannot.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import JsonValue

from ajgdata.ablations.base import Ablation, Folds, Hypothesis, Trial, folds_of, trial_table
from ajgdata.ablations.data import AblationData, nuisances
from ajgdata.acquire.source import Grasp
from ajgdata.evaluate.task_data import TaskData
from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.gripper.mirror_symmetry import mirror_plane
from ajgdata.report.blocks import TableFigure
from ajgdata.report.format import Caption, number
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Wave = Callable[[np.ndarray], np.ndarray]
DATASET, PERIOD_DEG = "orientation", 180.0
KNOWN, UNSEEN = "orientation-known", "orientation"
#: What of a setup makes a gripper and a session differ from their design.
OFF_DESIGN = ("assembly", "session")
CAME_OUT = "default, as it came out: transducers, balloon, fill and jig a little off"
#: Transducers off every mirror plane, a little and more; the rest is the default gripper.
LOPSIDED = (
    Gripper(speaker_mm=(-35.0, 0.75), microphone_mm=(27.5, -5.0)),
    Gripper(speaker_mm=(-35.0, 1.5), microphone_mm=(20.0, -10.0)),
)


def _lopsided() -> dict[str, Gripper]:
    return {f"transducers {mirror_plane(g)[1]:.0f} mm off any mirror plane": g for g in LOPSIDED}


def measure(data: AblationData) -> list[Table]:
    """Return trials, readings of the angle by each gripper, and distances of mirror images."""
    grasps = data.grasps(DATASET, each=3)
    default = data.recorded(DATASET, "direction", grasps)
    grippers = {
        "default": (GRIPPERS["default"], default),
        "moved-transducers": (
            GRIPPERS["moved-transducers"],
            data.changed(DATASET, "direction", grasps, {"gripper": "moved-transducers"}),
        ),
    }
    for name, gripper in _lopsided().items():
        moved: dict[str, JsonValue] = {"gripper": gripper.model_dump(mode="json")}
        grippers[name] = gripper, data.changed(DATASET, "direction", grasps, moved)
    still = data.changed(DATASET, "direction", grasps, {"grasp": {"nuisance": nuisances(0)}})
    trials: list[Trial] = []
    for name in ("default", "moved-transducers"):
        trials.append(_mirrored(data, "linear_plain", name, *grippers[name]))
    for model in data.models:
        read = {name: _direction(data, model, rows) for name, (_, rows) in grippers.items()}
        for name in _lopsided():
            trials.append(Trial(_moved(name), model, "rmse", "°", read["default"], read[name]))
        alike = Trial(SCATTER, model, "rmse", "°", read["default"], _direction(data, model, still))
        trials.append(alike)
        trials.append(_second_recordings(data, model))
    title = "Orientation: an angle and its mirror image"
    note = f"{len(grasps)} grasps of the bar at {len(set(default.value))} angles."
    return [
        trial_table("mirror", title, note, trials),
        _readings(data, grippers),
        _distances(data, grasps),
    ]


SCATTER = Hypothesis(
    (KNOWN, UNSEEN),
    "grasps of one angle differ too much",
    "no scatter of grasps (default gripper)",
)
COPIES = Hypothesis(
    (KNOWN,),
    "a second recording of a grasp, on the other side of the split, gives its angle away",
    "split that ignores grasps",
)


def _moved(name: str) -> Hypothesis:
    return Hypothesis(
        (KNOWN, UNSEEN),
        "the gripper is its own mirror image, so that an angle and its mirror image sound alike",
        name,
    )


def _mirrored(data: AblationData, model: str, name: str, gripper: Gripper, rows: TaskData) -> Trial:
    """Return the trial that reads what the mirror flips, then what it keeps."""
    axis, _ = mirror_plane(gripper)
    claim = Hypothesis(
        (),
        f"the mirror plane of the {name} gripper lies at {axis:.0f}°, as its transducers say:"
        " the sine of twice the angle from it cannot be read, its cosine can",
        "target: the cosine in place of the sine",
    )
    sine, cosine = (_part(data, model, rows, axis, f) for f in (np.sin, np.cos))
    return Trial(claim, model, "r2", "", sine, cosine)


def _part(data: AblationData, model: str, rows: TaskData, axis: float, wave: Wave) -> Folds:
    turned = rows._replace(value=wave(np.deg2rad(2 * (rows.value.astype(float) - axis))))
    return folds_of(data.validated(turned, "regression", model), "r2")


def _direction(data: AblationData, model: str, rows: TaskData) -> Folds:
    return folds_of(data.validated(rows, "regression", model, period=PERIOD_DEG), "rmse")


def _second_recordings(data: AblationData, model: str) -> Trial:
    """Return the trial of both splits on all recordings: each grasp has a second one."""
    rows = data.known(DATASET, "direction")
    split = [
        folds_of(data.validated(rows, "regression", model, period=PERIOD_DEG, random=r), "rmse")
        for r in (False, True)
    ]
    return Trial(COPIES, model, "rmse", "°", split[0], split[1], paired=False)


def _readings(data: AblationData, grippers: dict[str, tuple[Gripper, TaskData]]) -> Table:
    rows: list[dict[str, Value]] = []
    for name, (gripper, recorded) in grippers.items():
        axis, misfit = mirror_plane(gripper)
        parts = [_part(data, "linear_plain", recorded, axis, wave) for wave in (np.cos, np.sin)]
        direction = _direction(data, "linear_plain", recorded)
        rows.append(
            {
                "gripper": name,
                "speaker": "{:g}, {:g}".format(*gripper.speaker_mm),
                "microphone": "{:g}, {:g}".format(*gripper.microphone_mm),
                "axis": axis,
                "misfit": misfit,
                "cosine": float(np.mean(parts[0].values)),
                "sine": float(np.mean(parts[1].values)),
                "rmse": float(np.mean(direction.values)),
                "sd": float(np.std(direction.values, ddof=1)),
                "seconds": direction.seconds,
            }
        )
    return Table(
        "mirror_grippers",
        "Orientation: how far a gripper must be from its mirror image",
        "Misfit: how far the best mirror plane puts the transducers from where they are (0: the"
        " gripper is its own mirror image, or that with speaker and microphone exchanged). R² of"
        " what the mirror keeps (cosine) and flips (sine), and the error of the direction learned"
        " as (sin, cos) of twice the angle; ridge, mean over folds. Places, plane and misfit are of"
        " the design: as a gripper came out, transducers, balloon, fill and jig lie a little off.",
        (
            Column("gripper", "Gripper"),
            Column("speaker", "Speaker", "mm"),
            Column("microphone", "Microphone", "mm"),
            Column("axis", "Mirror plane", "°"),
            Column("misfit", "Misfit", "mm"),
            Column("cosine", "R² kept"),
            Column("sine", "R² flipped"),
            Column("rmse", "RMSE", "°"),
            Column("sd", "sd", "°"),
            Column("seconds", "Training", "s"),
        ),
        tuple(rows),
    )


def _distances(data: AblationData, grasps: Sequence[Grasp]) -> Table:
    """Return how far sounds of mirrored angles lie apart: the mirror without any model."""
    angles = np.array([20.0, 45.0, 70.0])
    rows: list[dict[str, Value]] = []
    default, as_it_is = GRIPPERS["default"], grasps[0].setup
    designed = {key: value for key, value in as_it_is.items() if key not in OFF_DESIGN}
    setups = {"default": (default, designed), CAME_OUT: (default, as_it_is)}
    setups |= {name: (gripper, designed) for name, gripper in _lopsided().items()}
    for name, (gripper, made) in setups.items():
        axis, _ = mirror_plane(gripper)
        setup = {**made, "gripper": gripper.model_dump(mode="json")}
        heard = partial(_heard, data, setup)
        true = heard(axis + angles)
        again = [heard(axis + angles, scatter=1.0, seed=seed) for seed in (1, 2)]
        rows.append(
            {
                "gripper": name,
                "mirrored": _apart(true, heard(axis - angles)),
                "turned": _apart(true, heard(axis + angles + 90)),
                "scatter": _apart(again[0], again[1]),
            }
        )
    return Table(
        "mirror_distances",
        "Orientation: the mirror without a model",
        "Relative L2 distance of the feature, without noise, root mean square over three"
        " angles: from the bar's mirror image and from the bar turned by 90° (no scatter of"
        " grasps), and between two grasps of the same angle. Grippers as designed, but one.",
        (
            Column("gripper", "Gripper"),
            Column("mirrored", "Mirror image"),
            Column("turned", "Turned by 90°"),
            Column("scatter", "Another grasp"),
        ),
        tuple(rows),
    )


def _heard(
    data: AblationData,
    setup: Mapping[str, Any],
    angles: np.ndarray,
    scatter: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """Return features (n, 1025) of the bar at `angles` (n,) in degrees, centred."""
    grasp = {"nuisance": nuisances(scatter), "seed": seed}
    return np.array([data.heard(setup, {**grasp, "angle_deg": angle}) for angle in angles])


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the root mean square over rows (n, 1025) of the relative distance."""
    change = np.linalg.norm(one - other, axis=1) / np.linalg.norm(other, axis=1)
    return float(np.sqrt(np.mean(np.square(change))))


def finding(table: Table) -> str:
    """Return the error of the gripper that is most its own mirror image, and of the least."""
    misfit, rmse = table.numbers("misfit"), table.numbers("rmse")
    least, most = int(np.argmin(misfit)), int(np.argmax(misfit))
    return (
        f"A gripper {number(misfit[least], 2)} mm from its mirror image errs by "
        f"{number(rmse[least], 2)}°, one {number(misfit[most], 2)} mm from it by "
        f"{number(rmse[most], 2)}°"
    )


def figure(table: Table) -> Figure:
    """Return the error of the direction against the misfit of each gripper's mirror plane."""
    from ajgdata.report.canvas import COLOURS, GREY, WIDTH_IN, line_style, new_figure
    from ajgdata.report.labels import label_end, label_point

    about = "direction of the bar by ridge, mean ± sd over folds, against the mirror plane's misfit"
    drawn = new_figure((WIDTH_IN, 3.4), finding(table), about, ["simulated"])
    left, right = drawn.subplots(1, 2)
    misfit, rmse, sd = (table.numbers(key) for key in ("misfit", "rmse", "sd"))
    left.errorbar(misfit, rmse, sd, fmt="o", color=COLOURS[0])
    for x, y, reach, name in zip(misfit, rmse, sd, table.column("gripper"), strict=True):
        label = "\n".join(textwrap.wrap(str(name), 20))
        label_point(left, x, y, label, COLOURS[0], float(np.nan_to_num(reach)))
    left.set(xlabel="misfit of the mirror plane (mm)", ylabel="RMSE (°)")
    left.set_ylim(bottom=0)
    left.set_xlim(0, 1.5 * misfit.max())
    last = int(np.argmax(misfit))
    for index, (key, label) in enumerate({"cosine": "kept", "sine": "flipped"}.items()):
        style = {**line_style(index), "ls": "none"}
        values = table.numbers(key)
        right.plot(misfit, values, label=f"{label} by the mirror", **style)
        label_end(right, misfit[last], values[last], f"{label} by\nthe mirror", str(style["color"]))
    right.axhline(0, color=GREY, lw=1.1, ls=":")
    label_end(right, None, 0, "no better than\nthe mean", GREY)
    right.set(xlabel="misfit of the mirror plane (mm)", ylabel="R²")
    right.set_ylim(top=1)
    return drawn


def caption(table: Table) -> Caption:
    """Return the caption of `figure`."""
    return Caption(
        "Left: error of the bar's direction against how far each gripper is from being its own "
        "mirror image. Right: how well the part of the angle is read that the mirror keeps, and "
        "the one that it flips; 0: no better than the mean.",
        f"{finding(table)}. Error of the direction, and R² of its two parts, against the misfit of "
        "the mirror plane.",
    )


ABLATION = Ablation(
    "mirror",
    datasets=(DATASET,),
    measure=measure,
    figures=(TableFigure("mirror_grippers", "misfit", caption, figure),),
)
