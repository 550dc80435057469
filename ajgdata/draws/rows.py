"""Rows of the paper that every draw is measured by, and the reduced data sets behind them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ajgdata.types import Recipe

#: How a value stands to the paper's: as near as can be, or no less, or no more than it.
Sense = Literal["near", "at least", "at most"]
CNN, CHEAP, NEIGHBOURS = "cnn", "linear_plain", "knn_plain"
#: Chance of four materials: what "near chance" means.
CHANCE_PERCENT = 25.0


@dataclass(frozen=True)
class Row:
    """One figure of the paper, read in one way.

    `paper` is its id in paper.yaml, `dataset` and `part` say what it is measured on. `target` is
    used where the paper's result is not one number.
    """

    name: str
    title: str
    dataset: str
    part: str
    paper: str
    unit: str
    sense: Sense = "near"
    target: float | None = None
    model: str = CNN


ROWS: tuple[Row, ...] = (
    Row("size_known", "known sizes, by grasp", "size", "known", "size-known", "mm"),
    Row("size_copies", "known sizes, by recording", "size", "copies", "size-known", "mm"),
    Row("size_withheld", "withheld sizes", "size", "withheld", "size-unknown", "mm"),
    Row("size_noise", "sizes at 80 dBA", "size", "noise", "noise", "mm"),
    Row("angle_known", "known angles, by grasp", "orientation", "known", "orientation-known", "°"),
    Row(
        "angle_copies", "known angles, by recording", "orientation", "copies",
        "orientation-known", "°",
    ),
    Row("angle_withheld", "withheld angles", "orientation", "withheld", "orientation", "°"),
    Row("sphere80", "material of 80 mm spheres", "sphere80", "known", "materials-sphere80", "%"),
    Row("plate", "material of plates", "plate", "known", "materials-plate", "%"),
    Row(
        "sphere30", "material of 30 mm spheres", "sphere30", "known", "materials-sphere30", "%",
        target=CHANCE_PERCENT,
    ),
    Row("objects", "16 objects", "ycb", "known", "ycb", "%"),
    Row("objects_knn", "16 objects, k-NN", "ycb", "known", "baselines", "%", model=NEIGHBOURS),
    Row("coffee", "energy lost in coffee", "media", "coffee", "media", "%", "at least"),
    Row(
        "metal", "energy of metal against plastic", "media", "metal", "media", "%", "at most",
        target=100.0,
    ),
)  # fmt: skip
BY_NAME = {row.name: row for row in ROWS}


@dataclass(frozen=True)
class Reduced:
    """How much of a data set's recipe a draw records; `left_out` are names of objects."""

    task: str
    sessions: int
    grasps: int
    samples: int = 1
    left_out: tuple[str, ...] = ()
    noisy: str = ""  #: data set whose signal chain the same grasps are recorded with again
    every: int = 1  #: of its objects in turn, one is kept for a first look


#: About 300 scenes. Two sessions each, as what differs between sessions is part of the rows.
REDUCED: dict[str, Reduced] = {
    "size": Reduced(
        "size", 2, 2, 2, ("cube_11p3", "cube_15p3", "cube_19p3", "cube_23p3"), "size_80dba", 2
    ),
    "orientation": Reduced("angle", 2, 2, 2, every=3),
    "sphere80": Reduced("material", 2, 3, 2),
    "plate": Reduced("material", 2, 3, 2),
    "sphere30": Reduced("material", 2, 3, 2),
    "ycb": Reduced("object", 2, 3, 2, every=4),
    "media": Reduced("reflection", 1, 1, every=2),
}
#: Coarse and short, for a first look and for tests.
QUICK_NUMERICS = {"dx_mm": 6.0, "max_time_s": 0.006}
QUICK_GRASPS = 3


def reduced(recipe: Recipe, by: Reduced, quick: bool = False) -> Recipe:
    """Return the recipe with fewer sessions, grasps and objects.

    `quick`: one session, fewer objects, a coarse grid.
    """
    kept = [one for one in recipe.objects if one.name not in by.left_out]
    changed: dict[str, object] = {
        "sessions": by.sessions, "grasps_per_object": by.grasps, "samples_per_grasp": by.samples,
    }  # fmt: skip
    if quick:
        kept = kept[:: by.every]
        scene = {**recipe.scene, "numerics": QUICK_NUMERICS}
        changed |= {"sessions": 1, "grasps_per_object": QUICK_GRASPS, "scene": scene}
    return recipe.model_copy(update={**changed, "objects": tuple(kept)})


def datasets_of() -> list[str]:
    """Return the data sets whose declarations a draw needs."""
    return [*REDUCED, *(by.noisy for by in REDUCED.values() if by.noisy)]
