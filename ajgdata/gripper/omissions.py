"""Which parts of a scene's physics a plan leaves out: those of which it was measured that they may.

`omissions.yaml` holds the largest change that leaving out a part made in any measured scene, by
material, shape and support; `tools/omission_table.py` writes it. A part is left out if that
change times MARGIN is below the tolerance. What the table does not hold is simulated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np
import yaml

from ajgdata.gripper.objects import (
    NonNegative,
    Object,
    ObjectPart,
    PartName,
    Positive,
    SceneModel,
    Support,
)
from ajgdata.gripper.scene import Scene

TABLE = "omissions.yaml"
#: Of a scene that was not measured, over the largest change of those that were: stated beforehand.
#: In the sizes and poses of the study the ratio is at most 1.2.
MARGIN = 3.0
#: By how much a scene may differ from the default and still be as the measured ones, which were
#: drawn from these ranges; by nothing else, but for what is in FREE.
RANGES = {
    "speaker_mm": 0.5,
    "microphone_mm": 0.5,
    "bed_depth_mm": 0.6,
    "askew_mm": 2.5,
    "fill_slope_deg": 2.5,
    "temperature_c": 2.0,
    "offset_x_mm": 6.5,
    "offset_y_mm": 6.5,
}
FREE = {"seed", "angle_deg", "history"}
#: What is solved where the grains' frame is.
WITH_FRAME: frozenset[ObjectPart] = frozenset({"motion", "elastic"})


@dataclass(frozen=True)
class Part:
    """One part of the physics: solved or left out, and the bound of what leaving it out changes as
    a relative change of a third octave or of the feature (None: not measured)."""

    name: PartName
    is_solved: bool
    effect: float | None = None


class Measured(SceneModel):
    """A kind of scene: sizes from `least_mm` to `most_mm`, and the largest `change` by part."""

    shape: Literal["cube", "box", "cylinder", "rod", "sphere", "ellipsoid"]
    material: str
    support: Literal["rigid", "concave"]
    least_mm: tuple[Positive, Positive, Positive]
    most_mm: tuple[Positive, Positive, Positive]
    scenes: int
    change: dict[ObjectPart, NonNegative]

    def holds(self, thing: Object, support: str) -> bool:
        """Return whether `thing` on a default `support` is of this kind."""
        kind = (self.shape, self.material, self.support)
        sizes = zip(self.least_mm, thing.size_mm, self.most_mm, strict=True)
        whole = thing.shell_mm is None and thing.gap_um is None
        return whole and kind == (thing.kind, thing.material, support) and all(
            low <= size <= high for low, size, high in sizes
        )  # fmt: skip


class MeasuredTable(SceneModel):
    """The table, the commit and the version of the physics it was measured with, and its grid."""

    commit: str
    physics: int
    dx_mm: Positive
    kinds: tuple[Measured, ...]


@cache
def measured_table() -> MeasuredTable:
    """Return the table of the package."""
    text = files("ajgdata.gripper").joinpath(TABLE).read_text(encoding="utf-8")
    return MeasuredTable.model_validate(yaml.safe_load(text))


def bounds(met: Scene) -> dict[ObjectPart, float]:
    """Return the largest change if each part is omitted; empty for a scene unlike the measured.

    `met` is the scene as the gripper meets it (`scene.as_met`).
    """
    if met.object is None or not _as_measured(met):
        return {}
    for kind in measured_table().kinds:
        if kind.holds(met.object, met.support.kind):
            return {part: MARGIN * change for part, change in kind.change.items()}
    return {}


def omitted(met: Scene, limits: dict[ObjectPart, float]) -> set[ObjectPart]:
    """Return the parts to leave out: those of the least of `limits` whose sum stays below the
    tolerance, and what the scene omits by name. With the grains' frame the object moves."""
    absent, total = set(met.numerics.omit), 0.0
    for part in sorted(limits, key=lambda name: (name in WITH_FRAME, limits[name])):
        if part in WITH_FRAME and "frame" not in absent:
            continue
        if total + limits[part] < met.numerics.tolerance:
            total += limits[part]
            absent.add(part)
    return absent if "frame" in absent else absent - WITH_FRAME


def _as_measured(met: Scene) -> bool:
    """Return whether the scene differs from the default by no more than the measured ones do."""
    if met.support != Support(kind=met.support.kind):
        return False
    usual = Scene()
    pairs = (
        (met.gripper, usual.gripper),
        (met.medium, usual.medium),
        (met.environment, usual.environment),
        (met.assembly, usual.assembly),
        (met.grasp, usual.grasp),
    )
    return all(
        np.max(np.abs(np.subtract(value, default)), initial=0.0) <= RANGES[name]
        if name in RANGES
        else value == default
        for scene, other in pairs
        for name, value, default in _settings(scene, other)
    )


def _settings(scene: SceneModel, other: SceneModel) -> Iterator[tuple[str, Any, Any]]:
    """Name and both values of each setting that is not free."""
    for name in type(scene).model_fields:
        if name == "nuisance":
            drawn = {"grain_force": 0.0}
            yield name, *(getattr(x, name).model_copy(update=drawn) for x in (scene, other))
        elif name not in FREE:
            yield name, getattr(scene, name), getattr(other, name)
