"""Rows of the paper that designs are compared by, and the reduced data sets behind them."""

from __future__ import annotations

from dataclasses import dataclass

from ajgdata.types import Recipe

CHEAP, NEIGHBOURS = "linear_plain", "knn_plain"


@dataclass(frozen=True)
class Row:
    """One result of the paper, measured in one way.

    `dataset` and `part` name what the row is measured on. `model` replaces the model of the
    comparison, if it is not empty.
    """

    name: str
    title: str
    dataset: str
    part: str
    unit: str
    model: str = ""


ROWS: tuple[Row, ...] = (
    Row("size_known", "known sizes, by grasp", "size", "known", "mm"),
    Row("size_copies", "known sizes, by recording", "size", "copies", "mm"),
    Row("size_withheld", "withheld sizes", "size", "withheld", "mm"),
    Row("size_noise", "sizes at 80 dBA", "size", "noise", "mm"),
    Row("angle_known", "known angles, by grasp", "orientation", "known", "°"),
    Row("angle_copies", "known angles, by recording", "orientation", "copies", "°"),
    Row("angle_withheld", "withheld angles", "orientation", "withheld", "°"),
    Row("sphere80", "material of 80 mm spheres", "sphere80", "known", "%"),
    Row("plate", "material of plates", "plate", "known", "%"),
    Row("sphere30", "material of 30 mm spheres", "sphere30", "known", "%"),
    Row("objects", "16 objects", "ycb", "known", "%"),
    Row("objects_knn", "16 objects, k-NN", "ycb", "known", "%", NEIGHBOURS),
)
BY_NAME = {row.name: row for row in ROWS}


@dataclass(frozen=True)
class Reduced:
    """What a comparison records of a data set; `left_out` are names of objects."""

    task: str
    left_out: tuple[str, ...] = ()
    noisy: str = ""  #: data set whose signal chain the same grasps are recorded with again
    every: int = 1  #: of its objects in turn, one is kept for a first look


REDUCED: dict[str, Reduced] = {
    "size": Reduced("size", ("cube_11p3", "cube_15p3", "cube_19p3", "cube_23p3"), "size_80dba", 2),
    "orientation": Reduced("angle", every=3),
    "sphere80": Reduced("material"),
    "plate": Reduced("material"),
    "sphere30": Reduced("material"),
    "ycb": Reduced("object", every=4),
}
#: Recordings of each grasp for rows that are split by recording.
COPIES = 2
#: Coarse and short, for a first look and for tests.
QUICK_NUMERICS = {"dx_mm": 6.0, "max_time_s": 0.006}
QUICK_GRASPS = 3


def reduced(
    recipe: Recipe, by: Reduced, *, sessions: int, grasps: int, samples: int, quick: bool = False
) -> Recipe:
    """Return the recipe with fewer sessions, grasps, recordings (`samples`) and objects.

    `quick`: one session, fewer objects, a coarse grid.
    """
    kept = [one for one in recipe.objects if one.name not in by.left_out]
    changed: dict[str, object] = {
        "sessions": sessions, "grasps_per_object": grasps, "samples_per_grasp": samples,
    }  # fmt: skip
    if quick:
        kept = kept[:: by.every]
        scene = {**recipe.scene, "numerics": QUICK_NUMERICS}
        changed |= {"sessions": 1, "grasps_per_object": QUICK_GRASPS, "scene": scene}
    return recipe.model_copy(update={**changed, "objects": tuple(kept)})


def datasets_of() -> list[str]:
    """Return the data sets whose configs a comparison needs."""
    return [*REDUCED, *(by.noisy for by in REDUCED.values() if by.noisy)]
