"""Orientation: an angle and its mirror image, and what makes them sound different.

A gripper whose transducers have nearly equal radii nearly equals its mirror image
(`gripper.mirror_symmetry`). A bar at θ then sounds like one at 2a - θ, a being the plane's angle:
cos 2(θ - a) can be predicted, sin 2(θ - a) cannot. Two changes break the mirror: transducers at
unequal radii, and a bar off the axis about which it is turned.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ajgdata.ablations.base import Ablation, Folds, Hypothesis, Trial, folds_of, trial_table
from ajgdata.ablations.data import AblationData, nuisances
from ajgdata.acquire.source import Grasp
from ajgdata.evaluate.task_data import TaskData
from ajgdata.gripper.grippers import GRIPPERS, Gripper
from ajgdata.gripper.mirror_symmetry import mirror_plane, mirror_planes
from ajgdata.gripper.object_library import BAR_ECCENTRIC_RANGE_MM, OBJECTS
from ajgdata.report.blocks import TableFigure
from ajgdata.report.format import number
from ajgdata.types.table import Column, Table, Value

if TYPE_CHECKING:
    from ajgdata.evaluate.crossval import CrossValidation
    from ajgdata.report.marks import Picture

Wave = Callable[[np.ndarray], np.ndarray]
#: The paper's angles, and twice as many in three setups: data set and gripper of each.
PAPER_ANGLES, PERIOD_DEG = "orientation", 180.0
DATASETS = {
    "default": ("orientation_fine", "default"),
    "unequal": ("orientation_unequal_radii", "unequal-radii"),
    "eccentric": ("orientation_eccentric", "default"),
}
#: Setups by the ends of the names of their columns, and beginnings of these names.
SETUPS = {
    "default": "default",
    "unequal": "transducers at unequal radii",
    "eccentric": "bar 3 mm off its axis",
}
DIRECTION, FROM_PLANE = "direction_", "from_plane_"
KNOWN, WITHHELD_ROW = "orientation-known", "orientation"
WITHHELD = "withheld"
#: What of a setup makes a gripper and a session differ from their design.
OFF_DESIGN = ("assembly", "session")
AS_BUILT = "default, as built: transducers, balloon, fill and jig a little off"
MIRROR_CLAIM = (
    "the gripper nearly equals its mirror image, so an angle and its mirror image give the same"
    " sound"
)
ECCENTRIC_CLAIM = "the bar was off the axis about which it was turned, so its mirror image differs"
SCATTER_CLAIM = "grasps of one angle differ too much"
COPIES_CLAIM = "a second recording of a grasp, in the training data, gives its angle away"


class Errors(NamedTuple):
    """Cross-validations of one setup: of the bar's direction, and of its angle from the plane."""

    direction: CrossValidation
    from_plane: CrossValidation


def measure(data: AblationData) -> list[Table]:
    """Return trials, errors by setup and by angle, and distances of mirror images."""
    trials = [_mirrored(data, *one) for one in _planes(data)]
    errors: dict[str, Errors] = {}
    for model in reversed(data.models):  # the tables are of the first
        errors = {key: _errors(data, model, name) for key, (name, _) in DATASETS.items()}
        trials += _setup_trials(model, errors)
        trials += _other_trials(data, model)
    note = (
        "Direction: sine and cosine of twice the angle; a guess has an error of about 53°. A guess"
        " of the angle from the mirror plane has about 25°. Bar at 40 angles, 16 withheld."
    )
    return [
        trial_table("mirror", "Orientation: an angle and its mirror image", note, trials),
        _setup_table(data, errors),
        angle_table(data, errors),
        _distances(data, data.grasps(DATASETS["default"][0])),
    ]


def _errors(data: AblationData, model: str, name: str) -> Errors:
    """Return errors on held-out grasps of training angles, and on withheld angles (WITHHELD)."""
    known, withheld = data.parts(name, "angle")
    direction = data.validated(
        known, "regression", model, period=PERIOD_DEG, extra_tests={WITHHELD: withheld}
    )
    known, withheld = data.parts(name, "angle_from_plane")
    extra = {WITHHELD: withheld}
    return Errors(direction, data.validated(known, "regression", model, extra_tests=extra))


def _setup_trials(model: str, errors: Mapping[str, Errors]) -> list[Trial]:
    """Return trials of both causes, and of the target that a mirror keeps."""
    trials = []
    default = errors["default"]
    for of, part in ((KNOWN, None), (WITHHELD_ROW, WITHHELD)):
        before = folds_of(default.direction, "rmse", part)
        for claim, change, after in (
            (MIRROR_CLAIM, SETUPS["unequal"], errors["unequal"].direction),
            (MIRROR_CLAIM, "target: angle from the mirror plane", default.from_plane),
            (ECCENTRIC_CLAIM, SETUPS["eccentric"], errors["eccentric"].direction),
        ):
            hypothesis = Hypothesis((of,), claim, change)
            result = folds_of(after, "rmse", part)
            trials.append(Trial(hypothesis, model, "rmse", "°", before, result))
    return trials


def _other_trials(data: AblationData, model: str) -> list[Trial]:
    """Return trials without scatter of grasps, and with a split that ignores grasps."""
    grasps = data.grasps(PAPER_ANGLES, each=3)
    still = data.changed(PAPER_ANGLES, "direction", grasps, {"grasp": {"nuisance": nuisances(0)}})
    scattered = data.recorded(PAPER_ANGLES, "direction", grasps)
    before, after = (_direction(data, model, rows) for rows in (scattered, still))
    change = f"no scatter of grasps (default gripper, {len(grasps)} grasps)"
    scatter = Hypothesis((KNOWN, WITHHELD_ROW), SCATTER_CLAIM, change)
    known = data.known(PAPER_ANGLES, "direction")
    by_grasp, by_recording = (_direction(data, model, known, random=r) for r in (False, True))
    copies = Hypothesis((KNOWN,), COPIES_CLAIM, "split that ignores grasps")
    return [
        Trial(scatter, model, "rmse", "°", before, after),
        Trial(copies, model, "rmse", "°", by_grasp, by_recording, paired=False),
    ]


def _direction(data: AblationData, model: str, rows: TaskData, random: bool = False) -> Folds:
    found = data.validated(rows, "regression", model, period=PERIOD_DEG, random=random)
    return folds_of(found, "rmse")


def _planes(data: AblationData) -> list[tuple[str, TaskData]]:
    """Return two grippers of equal radii, whose planes differ, and recordings of each."""
    grasps = data.grasps(PAPER_ANGLES, each=3)
    moved = data.changed(PAPER_ANGLES, "direction", grasps, {"gripper": "moved-transducers"})
    default = data.recorded(PAPER_ANGLES, "direction", grasps)
    return [("default", default), ("moved-transducers", moved)]


def _mirrored(data: AblationData, name: str, rows: TaskData) -> Trial:
    """Return the trial that predicts what the mirror flips, then what it keeps."""
    plane = mirror_plane(GRIPPERS[name]).angle_deg
    claim = (
        f"the mirror plane of the gripper {name} is at {plane:.0f}°, as its transducers' places"
        " give: the sine of twice the angle from it cannot be predicted, its cosine can"
    )
    change = "target: the cosine instead of the sine"
    sine, cosine = (_part(data, rows, plane, wave) for wave in (np.sin, np.cos))
    return Trial(Hypothesis((), claim, change), "linear_plain", "r2", "", sine, cosine)


def _part(data: AblationData, rows: TaskData, plane: float, wave: Wave) -> Folds:
    turned = rows._replace(value=wave(np.deg2rad(2 * (rows.value.astype(float) - plane))))
    return folds_of(data.validated(turned, "regression", "linear_plain"), "r2")


def _setup_table(data: AblationData, errors: Mapping[str, Errors]) -> Table:
    """Return the geometry of each setup, what is kept and flipped, and errors of both targets."""
    rows: list[dict[str, Value]] = []
    for key, (name, gripper) in DATASETS.items():
        known, _ = data.parts(name, "angle")
        kept, exchanged = mirror_planes(GRIPPERS[gripper])
        plane = mirror_plane(GRIPPERS[gripper]).angle_deg
        row: dict[str, Value] = {"setup": SETUPS[key], "plane": plane}
        row |= {"kept": kept.misfit_mm, "exchanged": exchanged.misfit_mm}
        for part, wave in (("cosine", np.cos), ("sine", np.sin)):
            row[part] = float(np.mean(_part(data, known, plane, wave).values))
        for target, found in errors[key]._asdict().items():
            row[target] = float(np.mean(folds_of(found, "rmse").values))
            row[f"{target}_withheld"] = float(np.mean(folds_of(found, "rmse", WITHHELD).values))
        rows.append(row)
    return Table(
        "mirror_setups",
        "Orientation: three setups",
        "Misfit: root mean square distance of the transducers from the places to which the best"
        " mirror brings them, if it keeps each one or exchanges the two (0: the gripper equals its"
        " mirror image). R² (ridge) of the part of the angle that this mirror keeps, and of the"
        f" part that it flips. RMSE ({_model_name(data)}): mean over folds on held-out grasps of"
        " training angles, and on withheld angles.",
        (
            Column("setup", "Setup"),
            Column("plane", "Mirror plane", "°"),
            Column("kept", "Misfit, each kept", "mm"),
            Column("exchanged", "Misfit, exchanged", "mm"),
            Column("cosine", "R² kept"),
            Column("sine", "R² flipped"),
            Column("direction", "RMSE of the direction", "°"),
            Column("direction_withheld", "Direction, withheld", "°"),
            Column("from_plane", "RMSE of the angle from the plane", "°"),
            Column("from_plane_withheld", "Angle from the plane, withheld", "°"),
        ),
        tuple(rows),
    )


def _model_name(data: AblationData) -> str:
    from ajgdata.models import model_label

    return model_label(data.models[0], "regression")


def angle_table(data: AblationData, errors: Mapping[str, Errors]) -> Table:
    """Return the error of both targets at each angle, in each setup."""
    from ajgdata.evaluate.withheld import by_value

    labels = data.labels(DATASETS["default"][0])
    rows: dict[float, dict[str, Value]] = {}
    for target in sorted(labels, key=lambda one: float(one["angle_deg"])):
        angle = float(target["angle_deg"])
        from_plane = float(target["angle_from_plane_deg"])
        rows[angle] = {"angle": angle, "plane": from_plane, "grid": str(target["grid"])}
    of_plane = {row["plane"]: row for row in rows.values()}
    for key, found in errors.items():
        for prefix, one, by, period in (
            (DIRECTION, found.direction, rows, PERIOD_DEG),
            (FROM_PLANE, found.from_plane, of_plane, None),
        ):
            withheld = one.extra_tests[WITHHELD].predictions
            for error in by_value(one.predictions, withheld, period):
                by[error.value] |= {"withheld": error.withheld, f"{prefix}{key}": error.rmse}
    names = {key: f"direction, {setup}" for key, setup in SETUPS.items()}
    planes = {key: f"angle from the plane, {setup}" for key, setup in SETUPS.items()}
    return Table(
        "mirror_angles",
        "Orientation: error at each angle",
        f"RMSE ({_model_name(data)}) on held-out grasps of training angles and on withheld angles."
        " Grid: the paper's 19 angles, and those between. Mirror planes: the same for all setups.",
        (
            Column("angle", "Angle", "°"),
            Column("plane", "From the plane", "°"),
            Column("grid", "Grid"),
            Column("withheld", "Withheld"),
            *(Column(f"{DIRECTION}{key}", f"RMSE, {text}", "°") for key, text in names.items()),
            *(Column(f"{FROM_PLANE}{key}", f"RMSE, {text}", "°") for key, text in planes.items()),
        ),
        tuple(rows.values()),
    )


def _distances(data: AblationData, grasps: Sequence[Grasp]) -> Table:
    """Return distances between the sounds of mirrored angles: the mirror without any model."""
    angles = np.array([20.0, 45.0, 70.0])
    rows: list[dict[str, Value]] = []
    as_built = grasps[0].setup
    designed = {key: value for key, value in as_built.items() if key not in OFF_DESIGN}
    unequal = GRIPPERS["unequal-radii"]
    wide = Gripper(roof_radius_mm=unequal.roof_radius_mm)
    far = BAR_ECCENTRIC_RANGE_MM[1]
    for name, gripper, setup in (
        ("default", Gripper(), designed),
        (AS_BUILT, Gripper(), as_built),
        (f"default, roof of {wide.roof_radius_mm:g} mm", wide, designed),
        (SETUPS["unequal"], unequal, designed),
        (SETUPS["eccentric"], Gripper(), {**designed, "object": "bar_eccentric"}),
        (f"bar {far:g} mm off the axis", Gripper(), {**designed, "object": _eccentric(far)}),
    ):
        plane = mirror_plane(gripper).angle_deg
        sound = partial(_sound, data, {**setup, "gripper": gripper.model_dump(mode="json")})
        true = sound(plane + angles)
        again = [sound(plane + angles, scatter=1.0, seed=seed) for seed in (1, 2)]
        rows.append(
            {
                "setup": name,
                "mirrored": _distance(true, sound(plane - angles)),
                "turned": _distance(true, sound(plane + angles + 90)),
                "scatter": _distance(again[0], again[1]),
            }
        )
    return Table(
        "mirror_distances",
        "Orientation: the mirror without a model",
        "Relative L2 distance of the feature, without noise, root mean square over three angles:"
        " from the bar's mirror image and from the bar turned by 90° (no scatter of grasps), and"
        " between two grasps of the same angle. Setups as designed, except the second.",
        (
            Column("setup", "Setup"),
            Column("mirrored", "Mirror image"),
            Column("turned", "Turned by 90°"),
            Column("scatter", "Another grasp"),
        ),
        tuple(rows),
    )


def _eccentric(aside_mm: float) -> dict[str, Any]:
    """Return the paper's bar `aside_mm` off the axis about which it is turned."""
    bar = OBJECTS["bar_eccentric"].shape.model_dump(mode="json")
    (part,) = bar["parts"]
    return {**bar, "parts": [{**part, "y_mm": aside_mm}]}


def _sound(
    data: AblationData,
    setup: Mapping[str, Any],
    angles: np.ndarray,
    scatter: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """Return features (n, 1025) of the bar at `angles` (n,) in degrees, centred."""
    grasp = {"nuisance": nuisances(scatter), "seed": seed}
    return np.array([data.heard(setup, {**grasp, "angle_deg": angle}) for angle in angles])


def _distance(first: np.ndarray, second: np.ndarray) -> float:
    """Return the root mean square over rows (n, 1025) of the relative distance."""
    change = np.linalg.norm(first - second, axis=1) / np.linalg.norm(second, axis=1)
    return float(np.sqrt(np.mean(np.square(change))))


def finding(table: Table) -> str:
    """Return the error of the direction at withheld angles in each setup, and from the plane."""
    withheld = table.where(withheld=True)

    def rmse(column: str) -> str:
        return f"{number(float(np.sqrt(np.mean(withheld.numbers(column) ** 2))), 2)}°"

    listed = ", ".join(f"{rmse(DIRECTION + key)} {setup}" for key, setup in SETUPS.items())
    return f"Withheld angles: {listed}; angle from the mirror plane {rmse(FROM_PLANE + 'default')}"


def angles_picture(table: Table) -> Picture:
    """Return errors of the direction and of the angle from the plane against the angle."""
    from ajgdata.report.study_figures import picture_of, points_of

    panels = {DIRECTION: "direction", FROM_PLANE: "angle from the mirror plane"}
    points = [
        point._replace(series=setup, panel=panel)
        for prefix, panel in panels.items()
        for key, setup in SETUPS.items()
        for point in points_of(table, f"{prefix}{key}", "withheld", "angle")
    ]
    axis, place = ("RMSE", "°"), ("angle of the bar", "°")
    return picture_of(finding(table), "at each angle of the bar", points, axis, place, log=False)


ABLATION = Ablation(
    "mirror",
    datasets=(PAPER_ANGLES, *(name for name, _ in DATASETS.values())),
    measure=measure,
    figures=(
        TableFigure(
            "mirror_angles",
            "angles",
            "lines",
            angles_picture,
            "Error of the bar's direction and of its angle from the mirror plane. The table says "
            "which angles were withheld from training.",
        ),
    ),
)
